// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <utility>

namespace blockwalk {

// A number of things that exist now; told when there are none any more.
struct Count {
  std::int64_t now = 0;
  std::function<void()> on_none = {};
};

// One of them, as long as this lives: in a coroutine however that ends, even by being destroyed unfinished.
class Counted {
 public:
  explicit Counted(Count& count) : count_(&count) { ++count_->now; }
  Counted(Counted&& other) noexcept : count_(std::exchange(other.count_, nullptr)) {}
  Counted& operator=(Counted&&) = delete;
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;
  ~Counted() {
    if (count_ != nullptr && --count_->now == 0 && count_->on_none) count_->on_none();
  }

 private:
  Count* count_;
};

}  // namespace blockwalk
