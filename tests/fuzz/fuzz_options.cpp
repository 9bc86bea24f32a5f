// SPDX-License-Identifier: Apache-2.0
// The daemon's options: an argument a line, after a NUL the configuration file, after another the token file. What
// parses is within the table's bounds, and no address beyond this machine goes without a token; the rest is refused as
// wrong usage.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/options.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/target.h"

namespace {

using blockwalk::MemoryFile;
using blockwalk::ServerOptions;

std::string_view takeUpTo(std::string_view& rest, char end) {
  const std::size_t at = rest.find(end);
  const std::string_view part = rest.substr(0, at);
  rest.remove_prefix(at == std::string_view::npos ? rest.size() : at + 1);
  return part;
}

void requireBounds(const ServerOptions& options) {
  for (const blockwalk::ServerOption& option : blockwalk::serverOptions()) {
    const auto* count = std::get_if<std::int64_t ServerOptions::*>(&option.member);
    if (count != nullptr && (options.**count < option.lo || options.**count > option.hi)) std::abort();
  }
}

template <typename Parse>
void parseOrRefuse(Parse parse) {
  try {
    parse();
  } catch (const blockwalk::UsageError&) {
    // Refused, as most input is.
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const MemoryFile configuration, token;
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  std::string_view lines = takeUpTo(rest, '\0');
  std::vector<std::string> arguments;
  while (!lines.empty()) {
    const std::string_view line = takeUpTo(lines, '\n');
    // A file that the input names might be a device; the configuration is this input's own.
    if (!line.starts_with("--config")) arguments.emplace_back(line);
  }
  if (!rest.empty()) {
    const std::string_view text = takeUpTo(rest, '\0');
    configuration.fill(text.data(), text.size());
    arguments.push_back("--config=" + configuration.path());
  }
  parseOrRefuse([&] {
    const ServerOptions options = blockwalk::parseServerOptions(arguments);
    requireBounds(options);
    const blockwalk::ListenAddress address = blockwalk::listenAddress(options);
    if (!address.loopback && options.token_file.empty()) std::abort();
  });
  token.fill(rest.data(), rest.size());
  parseOrRefuse([&] {
    const std::string read = blockwalk::readToken(token.path());
    if (read.size() < 16 || rest.find(read) == std::string_view::npos) std::abort();
  });
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  using std::string_literals::operator""s;
  return {"--listen\n127.0.0.1:8080\n--header-time=5\n--body-limit\n65536\nfossil.bwv"s,
          "--listen=[::1]:0\n--no-ray-query\n--validation\n--device=llvmpipe\n--frames-in-flight\n2"s,
          "--listen\n0.0.0.0:443\n--token-file\ntoken\n--tls-cert\na.pem\n--tls-key\nb.pem"s,
          "--idle-time\n60\0{\"listen\": \"localhost:81\", \"files\": [\"a.bwv\", \"b.bwv\"], \"max-sessions\": 4, "
          "\"send-time\": \"20\", \"no-ray-query\": true}\0"s
          " 0123456789abcdef_-XYZ\n"s,
          "\0{\"validation\": false, \"encode-threads\": 64, \"web-root\": \"web\"}\0short"s};
}
