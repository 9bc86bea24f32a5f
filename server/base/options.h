// SPDX-License-Identifier: Apache-2.0
// blockwalkd's options: one table, from which flags, the configuration file and --help come.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "volume/error.h"

namespace blockwalk {

struct ServerOptions {
  std::string listen = "127.0.0.1:8080";
  std::filesystem::path volumes = {};  // folder; every *.bwv in it is served
  std::vector<std::filesystem::path> files = {};
  std::filesystem::path token_file = {};
  std::filesystem::path tls_cert = {};  // PEM chain and key: both or none
  std::filesystem::path tls_key = {};
  std::filesystem::path web_root = {};  // empty: beside the executable
  std::string device = {};
  std::uint64_t memory_budget = 0;  // of the device; 0: what it says
  bool no_ray_query = false;
  bool validation = false;
  // Bounds. Times are in seconds.
  std::int64_t header_time = 10;
  std::int64_t body_time = 30;
  std::int64_t idle_time = 60;
  std::int64_t send_time = 20;
  std::int64_t send_rate = 24 << 10;  // bytes a second
  std::int64_t drain_time = 4;        // so that the process ends within 5
  std::int64_t header_limit = 32 << 10;
  std::int64_t body_limit = 1 << 20;
  std::int64_t max_connections = 512;
  std::int64_t max_sessions = 64;
  std::int64_t max_image_jobs = 32;
  std::int64_t max_megapixels = 256;
  std::uint64_t max_region = std::uint64_t{1} << 30;  // bytes
  std::int64_t message_rate = 4000;
  std::int64_t message_bytes = 4 << 20;  // a second
  std::int64_t frames_in_flight = 3;
  std::int64_t encode_threads = 2;
};

using OptionMember = std::variant<std::string ServerOptions::*, std::filesystem::path ServerOptions::*,
                                  bool ServerOptions::*, std::int64_t ServerOptions::*, std::uint64_t ServerOptions::*>;

struct ServerOption {
  std::string_view name;   // --name, and the configuration's member
  std::string_view value;  // how to write it; empty: a switch
  std::string_view help;
  OptionMember member;
  std::int64_t lo = 0;  // whole numbers, and sizes in bytes: bounds, inclusive
  std::int64_t hi = 0;
};

// Wrong usage: exit code 2.
struct UsageError : DataError {
  using DataError::DataError;
};

std::span<const ServerOption> serverOptions();
std::string serverHelp();

// `arguments` without the program's name. `--config FILE` is read first; what stands on the command line wins.
// Throws UsageError: an unknown or repeated option, or a value out of bounds; of the configuration it names the file
// and the member.
ServerOptions parseServerOptions(const std::vector<std::string>& arguments);

struct ListenAddress {
  std::string host;  // an IP address
  std::uint16_t port = 0;
  bool loopback = true;
};
// Of `--listen`: IP:PORT, [IPv6]:PORT or localhost:PORT. Throws UsageError; also when the address is not loopback and
// there is no token file, as a server that others reach must know them.
ListenAddress listenAddress(const ServerOptions& options);

// `files`, then every *.bwv of the folder `volumes` by name. Throws UsageError when the folder cannot be read.
std::vector<std::filesystem::path> volumeFiles(const ServerOptions& options);

// The token, without white space around it. Throws UsageError: unreadable, or shorter than 16 characters.
std::string readToken(const std::filesystem::path& file);

}  // namespace blockwalk
