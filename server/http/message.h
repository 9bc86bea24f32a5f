// SPDX-License-Identifier: Apache-2.0
// An HTTP request as it was read and a reply as it will be sent: plain data, no sockets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/problem.h"
#include "server/base/bytes.h"

namespace blockwalk {

struct HttpRequest {
  std::string method;
  std::string target;
  int version = 11;  // 10 or 11
  std::vector<std::pair<std::string, std::string>> fields;
  std::string body;

  std::size_t count(std::string_view name) const;                      // names compare without case
  std::string_view value(std::string_view name) const;                 // of the first; empty when absent
  bool hasToken(std::string_view name, std::string_view token) const;  // in a comma separated list, without case
  std::string_view path() const { return std::string_view(target).substr(0, target.find('?')); }
  std::string_view query() const;
};

struct HttpReply {
  int status = 200;
  std::string type = {};  // of the body
  std::vector<std::pair<std::string, std::string>> fields = {};
  Bytes body = {};                  // without an owner: none
  std::uint64_t more_bytes = 0;     // that follow the body, from who sends it
  bool is_chunked = false;          // what follows has a length that is not known: HTTP/1.1 alone
  bool omit_body = false;           // the answer to HEAD
  bool close = false;               // the connection ends after this
  std::shared_ptr<void> room = {};  // kept until the reply is sent
};

HttpReply textReply(int status, std::string type, std::string_view text);
HttpReply problemReply(const Problem& problem);

// "HTTP/1.1 200 OK\r\n...\r\n\r\n"; Date is left out, as nothing here depends on the wall clock.
std::string replyHead(const HttpReply& reply);

// Whether a comma separated list has this token, without case.
bool hasToken(std::string_view list, std::string_view token);

// Without spaces and tabs around it.
std::string_view withoutSpace(std::string_view text);

// Equal without case, ASCII.
bool equalNames(std::string_view a, std::string_view b);

}  // namespace blockwalk
