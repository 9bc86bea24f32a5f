// SPDX-License-Identifier: Apache-2.0
// A server that gives every request the same answer, on a port of its own, until it is destroyed.
#pragma once

#include <openssl/types.h>

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace blockwalk {

struct FixedServerOptions {
  bool ipv6 = false;                       // listens at ::1 instead of 127.0.0.1
  std::filesystem::path certificate = {};  // PEM, with the key in the same file: speaks TLS alone
};

class FixedServer {
 public:
  explicit FixedServer(std::string answer, const FixedServerOptions& options = {});
  ~FixedServer();
  FixedServer(const FixedServer&) = delete;
  FixedServer& operator=(const FixedServer&) = delete;

  // False where the machine has no such address.
  bool isListening() const { return port_ != 0; }
  int port() const { return port_; }
  std::string url(const std::string& path) const;
  // The last request; read it after the client has ended.
  std::string request() const;

 private:
  void serve();
  void answerPeer(int peer);

  std::string answer_;
  FixedServerOptions options_;
  std::shared_ptr<SSL_CTX> tls_;  // null: plain
  int listener_ = -1;
  int port_ = 0;
  mutable std::mutex mutex_{};
  std::string request_{};
  std::thread thread_{};
};

// Status line, headers, the body's length and the body.
std::string answerOf(const std::string& status, const std::string& headers, const std::string& body);

// A certificate signed by itself for this IP address, good for an hour, and its key after it.
void writeCertificate(const std::filesystem::path& file, const std::string& address);

}  // namespace blockwalk
