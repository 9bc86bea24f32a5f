// SPDX-License-Identifier: Apache-2.0
// The body of a reply that is made while the client takes it.
#pragma once

#include <atomic>
#include <boost/asio/awaitable.hpp>
#include <exception>
#include <memory>
#include <string>

#include "server/base/bytes.h"

namespace blockwalk {

struct BodyPiece {
  std::string head = {};  // before the bytes
  Bytes bytes = {};
  std::shared_ptr<void> room = {};  // kept until the piece is sent
  std::exception_ptr error = {};    // the body ends early

  std::size_t size() const { return head.size() + bytes.size(); }
};

class ReplyBody {
 public:
  virtual ~ReplyBody() = default;
  // Asked for when the client has taken the one before; an empty one at the end. `cancel` ends the work on it.
  virtual boost::asio::awaitable<BodyPiece> next(std::shared_ptr<std::atomic<bool>> cancel) = 0;
  // For the log: "a region".
  virtual const char* name() const = 0;
};

}  // namespace blockwalk
