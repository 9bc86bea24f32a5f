// SPDX-License-Identifier: Apache-2.0
// XXH3-64 of bytes that come in parts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

struct XXH3_state_s;

namespace blockwalk {

class RunningChecksum {
 public:
  RunningChecksum();
  ~RunningChecksum();
  RunningChecksum(RunningChecksum&&) noexcept = default;
  RunningChecksum& operator=(RunningChecksum&&) noexcept = default;

  void reset();
  void add(std::span<const std::byte> bytes);
  std::uint64_t value() const;

 private:
  struct Free {
    void operator()(XXH3_state_s* state) const;
  };
  std::unique_ptr<XXH3_state_s, Free> state_;
};

// Of all at once.
std::uint64_t checksumOf(std::span<const std::byte> bytes);

}  // namespace blockwalk
