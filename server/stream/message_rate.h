// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "server/stream/pace.h"

namespace blockwalk {

// How much a client may send in a second, in messages and in bytes.
class MessageRate {
 public:
  MessageRate(std::int64_t messages, std::int64_t bytes) : most_messages_(messages), most_bytes_(bytes) {}

  // One came. When the next may be read: not before now.
  Clock::time_point add(std::size_t bytes, Clock::time_point now) {
    if (now - begin_ >= kSecond) {
      begin_ = now;
      messages_ = bytes_ = 0;
    }
    bytes_ += static_cast<std::int64_t>(bytes);
    return ++messages_ >= most_messages_ || bytes_ >= most_bytes_ ? begin_ + kSecond : now;
  }

 private:
  static constexpr std::chrono::seconds kSecond{1};

  std::int64_t most_messages_;
  std::int64_t most_bytes_;
  std::int64_t messages_ = 0;
  std::int64_t bytes_ = 0;
  Clock::time_point begin_{};
};

}  // namespace blockwalk
