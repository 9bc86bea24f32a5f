// SPDX-License-Identifier: Apache-2.0
// A request's header from outside: read as a connection reads it, then judged. What passes must hold what the rules
// promise to those behind them, a refusal must be one well-formed reply that ends the connection, and no field opens
// what it does not name.
#include <algorithm>
#include <array>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/request_head.h"
#include "server/http/rules.h"
#include "tests/fuzz/target.h"

namespace {

using blockwalk::HttpReply;
using blockwalk::HttpRequest;
using blockwalk::HttpRules;
namespace beast = boost::beast;

constexpr std::string_view kToken = "0123456789abcdefXYZ";
constexpr std::string_view kTag = "\"a,b\"";

std::optional<HttpRequest> readHead(std::string_view bytes) {
  beast::http::request_parser<beast::http::empty_body> parser;
  parser.header_limit(32 << 10);
  beast::error_code error;
  parser.put(boost::asio::buffer(bytes.data(), bytes.size()), error);
  if (error || !parser.is_header_done()) return {};
  return blockwalk::plainRequest(parser.get());
}

// True where a field of that name, if there is one, holds one of the texts.
bool holds(const HttpRequest& request, std::string_view name, std::initializer_list<std::string_view> texts) {
  return std::any_of(request.fields.begin(), request.fields.end(), [&](const auto& field) {
    return blockwalk::equalNames(field.first, name) && std::any_of(texts.begin(), texts.end(), [&](auto text) {
             const auto same = [](char a, char b) { return blockwalk::equalNames({&a, 1}, {&b, 1}); };
             return std::search(field.second.begin(), field.second.end(), text.begin(), text.end(), same) !=
                    field.second.end();
           });
  });
}

void require(bool holds) {
  if (!holds) std::abort();
}

// A status line and fields, each a line of its own, then an empty one: nothing of the request splits the reply.
void requireWellFormed(const HttpReply& reply) {
  const std::string head = blockwalk::replyHead(reply);
  require(head.ends_with("\r\n\r\n") && head.find("\r\n\r\n") == head.size() - 4);
  require(std::count(head.begin(), head.end(), '\n') == std::count(head.begin(), head.end(), '\r'));
  require(head.find('\0') == std::string::npos);
}

template <std::size_t count>
void requireRefusal(const HttpReply& reply, const std::array<int, count>& statuses) {
  require(std::find(statuses.begin(), statuses.end(), reply.status) != statuses.end());
  requireWellFormed(reply);
}

void judge(const HttpRequest& request, const HttpRules& rules) {
  if (const auto refusal = blockwalk::judgeHead(request, rules)) {
    requireRefusal(*refusal, std::array{400, 403, 413, 417, 501});
    require(refusal->close);
  } else {
    require(request.count("Host") == 1 || (request.count("Host") == 0 && request.version == 10));
    require(request.count("Content-Length") + request.count("Transfer-Encoding") <= 1);
    if (request.count("Content-Length") == 1) {
      require(std::stoull(std::string(request.value("Content-Length"))) <= rules.body_limit);
    }
    require(request.target.starts_with('/') || (request.method == "OPTIONS" && request.target == "*"));
    if (rules.loopback && request.version == 11) require(holds(request, "Host", {"localhost", "127.0.0.1", "[::1]"}));
  }
  if (const auto refusal = blockwalk::judgeUpgrade(request, rules)) {
    requireRefusal(*refusal, std::array{400, 403, 426});
  } else {
    require(holds(request, "Sec-WebSocket-Protocol", {"blockwalk.v1"}) && request.version == 11);
  }
  if (blockwalk::isAuthorized(request, rules) && !rules.token.empty()) {
    require(holds(request, "Authorization", {kToken}) || holds(request, "Cookie", {kToken}) ||
            holds(request, "Sec-WebSocket-Protocol", {kToken}));
  }
  if (blockwalk::matchesTag(request, kTag)) require(holds(request, "If-None-Match", {kTag, "*"}));
  if (blockwalk::acceptsType(request, "image/png")) {
    require(request.count("Accept") == 0 || holds(request, "Accept", {"image/png", "image/*", "*/*"}));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::optional<HttpRequest> request = readHead({reinterpret_cast<const char*>(data), size});
  if (!request) return 0;
  judge(*request, {.loopback = true, .tls = false, .token = {}, .body_limit = 1 << 20});
  judge(*request, {.loopback = false, .tls = true, .token = std::string(kToken), .body_limit = 1 << 20});
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  std::vector<std::string> seeds{
      R"(GET /api/v1/volumes/a/image?size=8x8 HTTP/1.1
Host: localhost:8080
Accept: text/html;q=0.5, image/*;q=0, image/png
If-None-Match: W/"x", "a,b", *
)",
      R"(POST /api/v1/volumes/a/image HTTP/1.1
Host: [::1]:80
Content-Length: 1048576
Expect: 100-continue
Authorization: Bearer 0123456789abcdefXYZ
Accept: */*
)",
      R"(POST / HTTP/1.1
Host: 127.0.0.1
Transfer-Encoding: chunked
Cookie: a=b; blockwalk_token=0123456789abcdefXYZ
)",
      R"(GET /api/v1/volumes/a/stream HTTP/1.1
Host: example.org
Upgrade: websocket
Connection: keep-alive, Upgrade
Sec-WebSocket-Version: 13
Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==
Sec-WebSocket-Protocol: blockwalk.v1, token.0123456789abcdefXYZ
Origin: https://example.org
)",
      R"(OPTIONS * HTTP/1.1
Host: localhost
Accept: a/b
	folded
If-None-Match: "open
)",
      "GET / HTTP/1.0\n"};
  for (std::string& seed : seeds) {
    for (std::size_t at = 0; (at = seed.find('\n', at)) != std::string::npos; at += 2) seed.insert(at, 1, '\r');
    seed += "\r\n";
  }
  return seeds;
}
