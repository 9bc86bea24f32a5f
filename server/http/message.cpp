// SPDX-License-Identifier: Apache-2.0
#include "server/http/message.h"

#include <algorithm>

namespace blockwalk {
namespace {

char lowerCase(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

std::string_view withoutSpace(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

bool equalNames(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lowerCase(x) == lowerCase(y); });
}

std::size_t HttpRequest::count(std::string_view name) const {
  return static_cast<std::size_t>(
      std::count_if(fields.begin(), fields.end(), [&](const auto& field) { return equalNames(field.first, name); }));
}

std::string_view HttpRequest::value(std::string_view name) const {
  for (const auto& field : fields) {
    if (equalNames(field.first, name)) return field.second;
  }
  return {};
}

bool hasToken(std::string_view list, std::string_view token) {
  while (!list.empty()) {
    const std::size_t comma = list.find(',');
    if (equalNames(withoutSpace(list.substr(0, comma)), token)) return true;
    list.remove_prefix(comma == std::string_view::npos ? list.size() : comma + 1);
  }
  return false;
}

bool HttpRequest::hasToken(std::string_view name, std::string_view token) const {
  return std::any_of(fields.begin(), fields.end(), [&](const auto& field) {
    return equalNames(field.first, name) && blockwalk::hasToken(field.second, token);
  });
}

std::string_view HttpRequest::query() const {
  const std::size_t mark = target.find('?');
  return mark == std::string::npos ? std::string_view() : std::string_view(target).substr(mark + 1);
}

HttpReply textReply(int status, std::string type, std::string_view text) {
  return {.status = status, .type = std::move(type), .fields = {}, .body = textBytes(text)};
}

HttpReply problemReply(const Problem& problem) {
  HttpReply reply = textReply(problem.status, std::string(kProblemMimeType), problemText(problem));
  reply.fields.emplace_back("Cache-Control", "no-store");
  return reply;
}

std::string replyHead(const HttpReply& reply) {
  std::string head = fmt::format("HTTP/1.1 {} {}\r\n", reply.status, reasonPhrase(reply.status));
  if (!reply.type.empty()) head += fmt::format("Content-Type: {}\r\n", reply.type);
  for (const auto& [name, value] : reply.fields) head += fmt::format("{}: {}\r\n", name, value);
  const bool never_a_body = reply.status == 204 || reply.status == 304;
  // A HEAD that renders nothing does not know the length, and may leave it out (RFC 9110, 9.3.2).
  if (reply.is_chunked) {
    head += "Transfer-Encoding: chunked\r\n";
  } else if (!never_a_body && (reply.body || reply.more_bytes > 0 || !reply.omit_body)) {
    head += fmt::format("Content-Length: {}\r\n", reply.body.size() + reply.more_bytes);
  }
  head += "X-Content-Type-Options: nosniff\r\n";
  if (reply.close) head += "Connection: close\r\n";
  return head + "\r\n";
}

}  // namespace blockwalk
