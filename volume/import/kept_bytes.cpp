// SPDX-License-Identifier: Apache-2.0
#include "volume/import/kept_bytes.h"

namespace blockwalk {

KeptBytes::Bytes KeptBytes::findOrBegin(std::uint64_t key) {
  std::unique_lock lock(mutex_);
  while (true) {
    const auto known = kept_.find(key);
    if (known != kept_.end()) {
      ages_.splice(ages_.begin(), ages_, known->second.age);
      return known->second.bytes;
    }
    if (being_made_.insert(key).second) return nullptr;
    ended_.wait(lock);
  }
}

void KeptBytes::keep(std::uint64_t key, const Bytes& bytes) {
  const std::lock_guard lock(mutex_);
  kept_bytes_ += bytes->size();
  while (kept_bytes_ > memory_bytes_ && !ages_.empty()) {
    const auto oldest = kept_.find(ages_.back());
    kept_bytes_ -= oldest->second.bytes->size();
    kept_.erase(oldest);
    ages_.pop_back();
  }
  ages_.push_front(key);
  kept_[key] = {bytes, ages_.begin()};
}

void KeptBytes::end(std::uint64_t key) {
  const std::lock_guard lock(mutex_);
  being_made_.erase(key);
  ended_.notify_all();
}

}  // namespace blockwalk
