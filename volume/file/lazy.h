// SPDX-License-Identifier: Apache-2.0
// What is made once it is asked for.
#pragma once

#include <memory>
#include <mutex>

namespace blockwalk {

// Any thread may ask: the first makes it, and who asks meanwhile waits. What throws is tried again by the next.
template <typename T>
class Lazy {
 public:
  template <typename Make>
  const T& get(Make make) const {
    const std::scoped_lock lock(mutex_);
    if (made_ == nullptr) made_ = make();
    return *made_;
  }

 private:
  mutable std::mutex mutex_;
  mutable std::unique_ptr<const T> made_;
};

}  // namespace blockwalk
