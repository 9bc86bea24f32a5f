// SPDX-License-Identifier: Apache-2.0
// How much is brought to the device at once: as much as there is time for, as the last pieces tell. A frame that is to
// be drawn next waits for one piece at most.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace blockwalk {

class UploadPace {
 public:
  using Time = std::chrono::microseconds;
  static constexpr Time kDeadline{4000};  // an eighth of a frame, of 30 a second
  static constexpr std::uint64_t kLeast = std::uint64_t{1} << 20;
  static constexpr std::uint64_t kFirst = std::uint64_t{4} << 20;
  static constexpr std::uint64_t kMost = std::uint64_t{8} << 20;

  std::uint64_t bytes() const { return bytes_; }

  // What a piece took. What is late is halved, what is early by far doubled, where it was not a small one.
  void took(std::uint64_t bytes, Time time) {
    if (time > kDeadline) {
      bytes_ = std::max(bytes_ / 2, kLeast);
    } else if (time < kDeadline / 4 && bytes >= bytes_ / 2) {
      bytes_ = std::min(bytes_ * 2, kMost);
    }
  }

 private:
  std::uint64_t bytes_ = kFirst;
};

}  // namespace blockwalk
