// SPDX-License-Identifier: Apache-2.0
#include "server/base/options.h"

#include <algorithm>
#include <array>
#include <boost/asio/ip/address.hpp>
#include <charconv>
#include <nlohmann/json.hpp>
#include <set>

#include "protocol/json_text.h"
#include "server/base/small_file.h"

namespace blockwalk {
namespace {

using Options = ServerOptions;

constexpr std::size_t kMinTokenCharacters = 16;
constexpr std::int64_t kMinBudget = std::int64_t{1} << 20;  // a small picture of a small volume
constexpr std::int64_t kMaxBudget = std::int64_t{1} << 60;

const std::array kOptions = {
    ServerOption{"listen", "HOST:PORT", "address to listen at; port 0 takes a free one", &Options::listen},
    ServerOption{"volumes", "DIR", "serve every *.bwv of this folder", &Options::volumes},
    ServerOption{"token-file", "FILE", "clients must know the token in this file; needed beyond loopback",
                 &Options::token_file},
    ServerOption{"tls-cert", "FILE", "certificate chain, PEM; with --tls-key the server speaks HTTPS only",
                 &Options::tls_cert},
    ServerOption{"tls-key", "FILE", "private key of the certificate, PEM", &Options::tls_key},
    ServerOption{"web-root", "DIR", "the page's files (default: beside the executable)", &Options::web_root},
    ServerOption{"device", "NAME", "part of a device's name, or its index", &Options::device},
    ServerOption{"memory-budget", "SIZE", "of device memory, as 2GiB, 512MiB or bytes (default: what the device says)",
                 &Options::memory_budget, kMinBudget, kMaxBudget},
    ServerOption{"no-ray-query", "", "hide ray queries, so that the grid serves everything", &Options::no_ray_query},
    ServerOption{"validation", "", "Vulkan validation, logged", &Options::validation},
    ServerOption{"header-time", "SECONDS", "for a request's header", &Options::header_time, 1, 3600},
    ServerOption{"body-time", "SECONDS", "for a request's body", &Options::body_time, 1, 3600},
    ServerOption{"idle-time", "SECONDS", "a connection may be silent", &Options::idle_time, 1, 86400},
    ServerOption{"send-time", "SECONDS", "a client may take nothing of what is sent, or acknowledge nothing",
                 &Options::send_time, 1, 3600},
    ServerOption{"send-rate", "BYTES", "a second that a client must take of a reply, after the send time",
                 &Options::send_rate, 1, 1 << 30},
    ServerOption{"drain-time", "SECONDS", "from SIGTERM to the end", &Options::drain_time, 1, 3600},
    ServerOption{"header-limit", "BYTES", "of a request's header", &Options::header_limit, 1024, 1 << 20},
    ServerOption{"body-limit", "BYTES", "of a request's body", &Options::body_limit, 1024, 1 << 30},
    ServerOption{"max-connections", "N", "open at the same time", &Options::max_connections, 1, 100000},
    ServerOption{"max-sessions", "N", "streams open at the same time", &Options::max_sessions, 1, 100000},
    ServerOption{"max-image-jobs", "N", "images of HTTP requests waiting at the same time", &Options::max_image_jobs, 1,
                 10000},
    ServerOption{"max-megapixels", "N", "of all frames waiting to be encoded", &Options::max_megapixels, 68, 100000},
    ServerOption{"max-region", "SIZE", "of the voxels in one reply (default: 1GiB)", &Options::max_region, 1,
                 std::int64_t{1} << 50},
    ServerOption{"message-rate", "N", "messages a second that a stream takes; more wait", &Options::message_rate, 1,
                 1000000},
    ServerOption{"message-bytes", "BYTES", "of messages a second that a stream takes; more wait",
                 &Options::message_bytes, 64 << 10, 1 << 30},
    ServerOption{"frames-in-flight", "N", "frames a stream sends without acknowledgement", &Options::frames_in_flight,
                 1, 3},
    ServerOption{"encode-threads", "N", "threads that encode images", &Options::encode_threads, 1, 64},
};

constexpr std::array<std::pair<std::string_view, int>, 5> kUnits = {
    {{"", 0}, {"KiB", 10}, {"MiB", 20}, {"GiB", 30}, {"TiB", 40}}};

// `name` is the option as a message names it: --NAME, or the configuration's member.
std::int64_t parseCount(std::string_view name, const ServerOption& option, std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < option.lo || value > option.hi) {
    throw UsageError(
        fmt::format("{}: must be a whole number from {} to {}, not '{}'", name, option.lo, option.hi, text));
  }
  return value;
}

// In the largest unit that divides it.
std::string sizeText(std::int64_t bytes) {
  auto unit = kUnits.rbegin();
  while (bytes % (std::int64_t{1} << unit->second) != 0) ++unit;
  return fmt::format("{}{}", bytes >> unit->second, unit->first);
}

// Bytes, or a number of KiB, MiB, GiB or TiB.
std::uint64_t parseSize(std::string_view name, const ServerOption& option, std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string_view unit = text.substr(static_cast<std::size_t>(end - text.data()));
  for (const auto& [known, shift] : kUnits) {
    if (error != std::errc() || unit != known || value > static_cast<std::uint64_t>(option.hi) >> shift) continue;
    if (value << shift >= static_cast<std::uint64_t>(option.lo)) return value << shift;
  }
  throw UsageError(fmt::format("{}: must be bytes, or a whole number of KiB, MiB, GiB or TiB, from {} to {}, not '{}'",
                               name, sizeText(option.lo), sizeText(option.hi), text));
}

const ServerOption* findOption(std::string_view name) {
  const auto found = std::find_if(kOptions.begin(), kOptions.end(), [&](const auto& o) { return o.name == name; });
  return found == kOptions.end() ? nullptr : &*found;
}

void setOption(Options& options, std::string_view name, const ServerOption& option, const std::string& text) {
  if (const auto* string = std::get_if<std::string Options::*>(&option.member)) {
    options.** string = text;
  } else if (const auto* path = std::get_if<std::filesystem::path Options::*>(&option.member)) {
    // None would be taken for an option that is not given: for no token, say.
    if (text.empty()) throw UsageError(fmt::format("{}: must name a {}, not ''", name, option.value));
    options.** path = text;
  } else if (const auto* count = std::get_if<std::int64_t Options::*>(&option.member)) {
    options.** count = parseCount(name, option, text);
  } else if (const auto* size = std::get_if<std::uint64_t Options::*>(&option.member)) {
    options.** size = parseSize(name, option, text);
  } else {
    options.*std::get<bool Options::*>(option.member) = true;
  }
}

std::string defaultText(const ServerOption& option) {
  const Options plain;
  if (const auto* string = std::get_if<std::string Options::*>(&option.member)) return plain.**string;
  if (const auto* count = std::get_if<std::int64_t Options::*>(&option.member)) return std::to_string(plain.**count);
  return "";
}

// As it stands in the file, shortened.
std::string shortText(const nlohmann::json& value) {
  constexpr std::size_t kShown = 40;
  const std::string text = writeJson(value);
  return text.size() <= kShown ? text : text.substr(0, kShown) + "...";
}

void readFiles(Options& options, std::string_view name, const nlohmann::json& value) {
  const bool are_files = value.is_array() && std::all_of(value.begin(), value.end(), [](const nlohmann::json& file) {
                           return file.is_string() && !file.get_ref<const std::string&>().empty();
                         });
  if (!are_files) throw UsageError(fmt::format("{}: must be an array of files' names, not {}", name, shortText(value)));
  for (const auto& file : value) options.files.emplace_back(file.get<std::string>());
}

void readMember(Options& options, std::string_view name, const ServerOption& option, const nlohmann::json& value) {
  const bool is_switch = option.value.empty();
  const bool is_text = value.is_string() && !is_switch;
  const bool is_count = std::holds_alternative<std::int64_t Options::*>(option.member);
  const bool is_size = std::holds_alternative<std::uint64_t Options::*>(option.member);
  const bool is_number = value.is_number_integer() && (is_count || is_size || option.name == "device");  // an index
  if (!(is_switch && value.is_boolean()) && !is_text && !is_number) {
    const char* form = is_switch  ? "true or false"
                       : is_count ? "a whole number"
                       : is_size  ? "a number of bytes, or a string"
                                  : "a string";
    throw UsageError(fmt::format("{}: must be {}, not {}", name, form, shortText(value)));
  }
  if (is_switch && !value.get<bool>()) return;
  setOption(options, name, option, value.is_string() ? value.get<std::string>() : value.dump());
}

void readConfiguration(Options& options, const std::filesystem::path& path) {
  const std::string file = fmt::format("--config '{}'", path.string());
  nlohmann::json object;
  try {
    object = parseJson(readSmallFile("config", path));
  } catch (const JsonError& error) {
    throw UsageError(fmt::format("{}: {}", file, error.what()));
  }
  const JsonEnd end(object);
  if (!object.is_object()) throw UsageError(fmt::format("{}: must hold a JSON object", file));
  for (const auto& [member, value] : object.items()) {
    const std::string name = fmt::format("{}: {:.60}", file, member);
    if (member == "files") {
      readFiles(options, name, value);
    } else if (const ServerOption* option = findOption(member); option != nullptr) {
      readMember(options, name, *option, value);
    } else {
      throw UsageError(fmt::format("{}: is no option; --help lists them", name));
    }
  }
}

// The command line as (option, text) pairs and files; the table says which options take a value.
struct CommandLine {
  std::filesystem::path configuration;
  std::vector<std::pair<const ServerOption*, std::string>> options;
  std::vector<std::filesystem::path> files;
};

CommandLine readCommandLine(const std::vector<std::string>& arguments) {
  CommandLine line;
  std::set<std::string> seen;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument.empty()) throw UsageError("FILE: must name a file, not ''");
    if (!argument.starts_with("--")) {
      if (argument.starts_with("-")) throw UsageError(fmt::format("{}: unknown option; --help lists them", argument));
      line.files.emplace_back(argument);
      continue;
    }
    const std::size_t equals = argument.find('=');
    const std::string name = argument.substr(2, equals == std::string::npos ? equals : equals - 2);
    const ServerOption* option = findOption(name);
    if (option == nullptr && name != "config") {
      throw UsageError(fmt::format("--{}: unknown option; --help lists them", name));
    }
    if (!seen.insert(name).second) throw UsageError(fmt::format("--{}: is given twice", name));
    const bool takes_value = option == nullptr || !option->value.empty();
    std::string text;
    if (equals != std::string::npos) {
      if (!takes_value) throw UsageError(fmt::format("--{}: takes no value", name));
      text = argument.substr(equals + 1);
    } else if (takes_value) {
      if (++i == arguments.size()) throw UsageError(fmt::format("--{}: needs a value", name));
      text = arguments[i];
    }
    if (option == nullptr) {
      if (text.empty()) throw UsageError("--config: must name a FILE, not ''");
      line.configuration = text;
    } else {
      line.options.emplace_back(option, std::move(text));
    }
  }
  return line;
}

}  // namespace

std::span<const ServerOption> serverOptions() { return kOptions; }

std::string serverHelp() {
  std::string help =
      "blockwalkd [options] [FILE.bwv...]\n"
      "Serves sparse volumes over HTTP and WebSocket, rendered here.\n\n"
      "  --config FILE               JSON object with these options as members, and \"files\"\n";
  for (const ServerOption& option : kOptions) {
    const std::string flag = fmt::format("--{} {}", option.name, option.value);
    const std::string text = defaultText(option);
    help += fmt::format("  {:<27} {}{}\n", flag, option.help, text.empty() ? "" : " (" + text + ")");
  }
  return help + "  --help                      this text\n  --version                   the version\n";
}

ServerOptions parseServerOptions(const std::vector<std::string>& arguments) {
  CommandLine line = readCommandLine(arguments);
  Options options;
  if (!line.configuration.empty()) readConfiguration(options, line.configuration);
  for (const auto& [option, text] : line.options) setOption(options, fmt::format("--{}", option->name), *option, text);
  if (!line.files.empty()) options.files = std::move(line.files);
  return options;
}

ListenAddress listenAddress(const ServerOptions& options) {
  const std::string& text = options.listen;
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) throw UsageError(fmt::format("--listen: must be HOST:PORT, not '{}'", text));
  std::string host = text.substr(0, colon);
  const ServerOption port_option{"listen", "", "", &Options::listen, 0, 65535};
  const auto port =
      static_cast<std::uint16_t>(parseCount("--listen: port", port_option, std::string_view(text).substr(colon + 1)));
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  if (host == "localhost") host = "127.0.0.1";
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(host, error);
  if (error) throw UsageError(fmt::format("--listen: '{}' is no IP address", host));
  const bool loopback = address.is_loopback();
  if (!loopback && options.token_file.empty()) {
    throw UsageError(fmt::format("--listen {}: others can reach this address, so --token-file is needed", text));
  }
  return {.host = address.to_string(), .port = port, .loopback = loopback};
}

std::vector<std::filesystem::path> volumeFiles(const ServerOptions& options) {
  std::vector<std::filesystem::path> files = options.files;
  if (options.volumes.empty()) return files;
  std::error_code error;
  std::vector<std::filesystem::path> found;
  std::filesystem::directory_iterator entry(options.volumes, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    if (entry->path().extension() == ".bwv") found.push_back(entry->path());
  }
  if (error) {
    throw UsageError(fmt::format("--volumes: cannot read '{}': {}", options.volumes.string(), error.message()));
  }
  std::sort(found.begin(), found.end());
  files.insert(files.end(), found.begin(), found.end());
  return files;
}

std::string readToken(const std::filesystem::path& file) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::string text = readSmallFile("token-file", file);
  const std::size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string::npos) throw UsageError(fmt::format("--token-file: '{}' is empty", file.string()));
  std::string token = text.substr(begin, text.find_last_not_of(kSpace) - begin + 1);
  const bool printable = std::all_of(token.begin(), token.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_';
  });
  if (token.size() < kMinTokenCharacters || !printable) {
    throw UsageError(fmt::format("--token-file: '{}' must hold at least {} letters, digits, '-' or '_'", file.string(),
                                 kMinTokenCharacters));
  }
  return token;
}

}  // namespace blockwalk
