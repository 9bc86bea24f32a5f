// SPDX-License-Identifier: Apache-2.0
#include "server/http/rules.h"

#include <openssl/crypto.h>

#include <algorithm>
#include <array>

#include "protocol/stream_messages.h"

namespace blockwalk {
namespace {

constexpr std::string_view kDigits = "0123456789";

HttpReply refuseHead(int status, std::string_view field, std::string detail) {
  return problemReply({.status = status, .detail = std::move(detail), .field = std::string(field)});
}

// The body's end cannot be trusted: what follows on this connection must not be read as a request.
HttpReply refuseAndClose(int status, std::string_view field, std::string detail) {
  HttpReply reply = refuseHead(status, field, std::move(detail));
  reply.close = true;
  return reply;
}

bool consistsOf(std::string_view text, std::string_view characters) {
  return !text.empty() && text.find_first_not_of(characters) == std::string_view::npos;
}

// host [":" port], where host is a name, an IPv4 address or "[" IPv6 "]". Returns the host; empty: not valid.
std::string_view hostName(std::string_view host) {
  constexpr std::string_view kNameCharacters = "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ-._";
  std::size_t end = host.find(':');
  if (host.starts_with('[')) {
    end = host.find(']');
    if (end == std::string_view::npos || !consistsOf(host.substr(1, end - 1), "0123456789abcdefABCDEF:.")) return {};
    ++end;
  } else if (!consistsOf(host.substr(0, end), kNameCharacters)) {
    return {};
  }
  const std::string_view name = host.substr(0, end);
  const std::string_view port = host.substr(name.size());
  const bool port_is_valid = port.empty() || (port.front() == ':' && port.size() <= 6 &&
                                              (port.size() == 1 || consistsOf(port.substr(1), kDigits)));
  return port_is_valid ? name : std::string_view();
}

bool namesThisMachine(std::string_view name) {
  return equalNames(name, "localhost") || name == "127.0.0.1" || name == "[::1]";
}

std::optional<HttpReply> judgeHost(const HttpRequest& request, const HttpRules& rules) {
  const std::size_t count = request.count("Host");
  // HTTP/1.0 knew no Host; one that is there is judged all the same.
  if (count == 0 && request.version == 10) return {};
  if (count != 1) return refuseAndClose(400, "Host", fmt::format("Host must be there once, not {} times", count));
  const std::string_view name = hostName(request.value("Host"));
  if (name.empty()) return refuseAndClose(400, "Host", "Host must be a name or an address, and a port");
  if (rules.loopback && !namesThisMachine(name)) {
    return refuseAndClose(403, "Host", "this server answers to localhost, 127.0.0.1 and [::1] only");
  }
  return {};
}

std::optional<HttpReply> judgeFraming(const HttpRequest& request, const HttpRules& rules) {
  const std::size_t lengths = request.count("Content-Length");
  const std::size_t encodings = request.count("Transfer-Encoding");
  if (lengths > 0 && encodings > 0) {
    return refuseAndClose(400, "Content-Length", "Content-Length and Transfer-Encoding exclude each other");
  }
  if (encodings > 0) {
    if (request.version == 10) return refuseAndClose(400, "Transfer-Encoding", "HTTP/1.0 has no Transfer-Encoding");
    if (encodings != 1 || !equalNames(request.value("Transfer-Encoding"), "chunked")) {
      return refuseAndClose(501, "Transfer-Encoding", "the only Transfer-Encoding is chunked");
    }
  }
  if (lengths > 0) {
    const std::string_view length = request.value("Content-Length");
    if (lengths != 1 || !consistsOf(length, kDigits) || length.size() > 19) {
      return refuseAndClose(400, "Content-Length", "Content-Length must be one number of digits alone");
    }
    if (std::stoull(std::string(length)) > rules.body_limit) {
      return refuseAndClose(413, "Content-Length", fmt::format("a body has at most {} bytes", rules.body_limit));
    }
  }
  return {};
}

std::optional<HttpReply> judgeTarget(const HttpRequest& request) {
  static constexpr std::array<std::string_view, 9> kMethods = {"GET",     "HEAD",  "POST",    "PUT",  "DELETE",
                                                               "OPTIONS", "PATCH", "CONNECT", "TRACE"};
  if (std::find(kMethods.begin(), kMethods.end(), request.method) == kMethods.end()) {
    return refuseAndClose(501, "method", "no such method");
  }
  if (request.method == "OPTIONS" && request.target == "*") return {};
  if (!request.target.starts_with('/')) return refuseAndClose(400, "target", "a request target must begin with '/'");
  const bool printable =
      std::all_of(request.target.begin(), request.target.end(), [](char c) { return c > ' ' && c <= '~' && c != '#'; });
  if (!printable) return refuseAndClose(400, "target", "a request target must be printable ASCII without '#'");
  return {};
}

std::string cookieToken(const HttpRequest& request) {
  constexpr std::string_view kName = "blockwalk_token=";
  std::string_view rest = request.value("Cookie");
  while (!rest.empty()) {
    const std::size_t end = rest.find(';');
    std::string_view cookie = rest.substr(0, end);
    cookie.remove_prefix(std::min(cookie.find_first_not_of(' '), cookie.size()));
    if (cookie.starts_with(kName)) return std::string(cookie.substr(kName.size()));
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  }
  return {};
}

// A browser says where the page came from; it must be this very server, scheme included.
bool isOwnOrigin(std::string_view origin, std::string_view host, bool tls) {
  const std::string_view scheme = tls ? "https://" : "http://";
  return origin.starts_with(scheme) && equalNames(origin.substr(scheme.size()), host);
}

// Takes the next entity tag off the list, without the W/ of a weak one; what is none comes back empty.
std::string_view takeTag(std::string_view& list) {
  list.remove_prefix(std::min(list.find_first_not_of(" \t,"), list.size()));
  if (list.starts_with("W/")) list.remove_prefix(2);
  if (!list.starts_with('"')) {
    list.remove_prefix(std::min(list.find(','), list.size()));
    return {};
  }
  const std::size_t close = list.find('"', 1);  // a tag may hold commas
  const std::string_view tag = close == std::string_view::npos ? std::string_view() : list.substr(0, close + 1);
  list.remove_prefix(close == std::string_view::npos ? list.size() : close + 1);
  return tag;
}

struct MediaRange {
  std::string_view type;
  bool is_wanted = true;  // its weight is not 0
};

// Is this a weight of 0? What is no weight is not.
bool isZeroWeight(std::string_view weight) {
  return weight == "0" || (weight.starts_with("0.") && weight.find_first_not_of('0', 2) == std::string_view::npos);
}

// Up to the next of `separators`, which is passed over; none of them counts inside quotes.
std::string_view takeUpTo(std::string_view& text, std::string_view separators) {
  bool quoted = false;
  std::size_t end = 0;
  for (; end < text.size() && (quoted || separators.find(text[end]) == std::string_view::npos); ++end) {
    if (quoted && text[end] == '\\') ++end;
    if (end < text.size() && text[end] == '"') quoted = !quoted;
  }
  end = std::min(end, text.size());
  const std::string_view taken = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return taken;
}

MediaRange takeMediaRange(std::string_view& list) {
  std::string_view item = takeUpTo(list, ",");
  MediaRange range{.type = withoutSpace(takeUpTo(item, ";"))};
  while (!item.empty()) {
    std::string_view value = withoutSpace(takeUpTo(item, ";"));
    const std::string_view name = takeUpTo(value, "=");
    if (equalNames(name, "q")) range.is_wanted = !isZeroWeight(value);
  }
  return range;
}

// How closely a range names a type: 2 for the type itself, 1 for its group, 0 for anything; -1: not at all.
int fitOf(std::string_view range, std::string_view type) {
  if (range == "*/*") return 0;
  if (equalNames(range, type)) return 2;
  const std::string_view group = type.substr(0, type.find('/') + 1);
  const bool is_group = range.ends_with("/*") && equalNames(range.substr(0, range.size() - 1), group);
  return is_group ? 1 : -1;
}

}  // namespace

std::optional<HttpReply> judgeHead(const HttpRequest& request, const HttpRules& rules) {
  if (auto reply = judgeHost(request, rules)) return reply;
  if (auto reply = judgeFraming(request, rules)) return reply;
  if (auto reply = judgeTarget(request)) return reply;
  if (request.count("Expect") > 0 && !equalNames(request.value("Expect"), "100-continue")) {
    return refuseAndClose(417, "Expect", "the only expectation is 100-continue");
  }
  return {};
}

std::optional<HttpReply> judgeUpgrade(const HttpRequest& request, const HttpRules& rules) {
  const auto field = [&](std::string_view name) { return request.value(name); };
  if (request.version != 11 || !request.hasToken("Upgrade", "websocket") ||
      !request.hasToken("Connection", "upgrade")) {
    HttpReply reply = refuseHead(426, "Upgrade", "this is a WebSocket: ask for an upgrade");
    reply.fields.emplace_back("Upgrade", "websocket");
    reply.fields.emplace_back("Connection", "Upgrade");
    return reply;
  }
  if (request.count("Sec-WebSocket-Version") != 1 || field("Sec-WebSocket-Version") != "13") {
    HttpReply reply = refuseHead(426, "Sec-WebSocket-Version", "the WebSocket version is 13");
    reply.fields.emplace_back("Sec-WebSocket-Version", "13");
    reply.fields.emplace_back("Upgrade", "websocket");
    return reply;
  }
  const std::string_view key = field("Sec-WebSocket-Key");
  constexpr std::string_view kBase64 = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  if (request.count("Sec-WebSocket-Key") != 1 || key.size() != 24 || !key.ends_with("==") ||
      !consistsOf(key.substr(0, 22), kBase64)) {
    return refuseHead(400, "Sec-WebSocket-Key", "Sec-WebSocket-Key must be 16 bytes in base64");
  }
  if (!request.hasToken("Sec-WebSocket-Protocol", kStreamProtocol)) {
    return refuseHead(400, "Sec-WebSocket-Protocol", fmt::format("the subprotocol is {}", kStreamProtocol));
  }
  if (request.count("Origin") > 0 && !isOwnOrigin(field("Origin"), field("Host"), rules.tls)) {
    return refuseHead(403, "Origin", "pages of another origin may not open this stream");
  }
  return {};
}

bool equalSecrets(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

bool isAuthorized(const HttpRequest& request, const HttpRules& rules) {
  if (rules.token.empty()) return true;
  constexpr std::string_view kScheme = "Bearer ";
  const std::string_view authorization = request.value("Authorization");
  if (authorization.size() > kScheme.size() && equalNames(authorization.substr(0, kScheme.size()), kScheme) &&
      equalSecrets(authorization.substr(kScheme.size()), rules.token)) {
    return true;
  }
  if (equalSecrets(cookieToken(request), rules.token)) return true;
  // A page cannot set a header on a WebSocket, but it can name subprotocols.
  std::string_view rest = request.value("Sec-WebSocket-Protocol");
  while (!rest.empty()) {
    const std::size_t comma = rest.find(',');
    std::string_view name = rest.substr(0, comma);
    name.remove_prefix(std::min(name.find_first_not_of(' '), name.size()));
    if (name.starts_with("token.") && equalSecrets(name.substr(6), rules.token)) return true;
    rest.remove_prefix(comma == std::string_view::npos ? rest.size() : comma + 1);
  }
  return false;
}

bool matchesTag(const HttpRequest& request, std::string_view etag) {
  for (const auto& [name, value] : request.fields) {
    if (!equalNames(name, "If-None-Match")) continue;
    if (value == "*") return true;
    std::string_view rest = value;
    while (!rest.empty()) {
      if (takeTag(rest) == etag) return true;
    }
  }
  return false;
}

bool acceptsGzip(const HttpRequest& request) {
  bool by_name = false;
  bool accepted = false;
  for (const auto& [name, value] : request.fields) {
    if (!equalNames(name, "Accept-Encoding")) continue;
    std::string_view rest = value;
    while (!rest.empty()) {
      const MediaRange coding = takeMediaRange(rest);  // its grammar (RFC 9110, 12.5.3)
      const bool is_gzip = equalNames(coding.type, "gzip") || equalNames(coding.type, "x-gzip");
      if (!is_gzip && (by_name || coding.type != "*")) continue;
      accepted = coding.is_wanted;
      by_name = is_gzip;
    }
  }
  return accepted;
}

bool acceptsType(const HttpRequest& request, std::string_view type) {
  if (request.count("Accept") == 0) return true;
  // The most specific range that fits decides (RFC 9110, 12.5.1).
  int specific = -1;
  bool accepted = false;
  for (const auto& [name, value] : request.fields) {
    if (!equalNames(name, "Accept")) continue;
    std::string_view rest = value;
    while (!rest.empty()) {
      const MediaRange range = takeMediaRange(rest);
      const int fit = fitOf(range.type, type);
      if (fit < 0 || fit < specific) continue;
      accepted = fit == specific ? accepted || range.is_wanted : range.is_wanted;
      specific = fit;
    }
  }
  return accepted;
}

}  // namespace blockwalk
