// SPDX-License-Identifier: Apache-2.0
#include "volume/import/kept_bytes.h"

namespace blockwalk {

KeptBytes::Bytes KeptBytes::find(std::uint64_t key) {
  const std::lock_guard lock(mutex_);
  const auto known = kept_.find(key);
  if (known == kept_.end()) return nullptr;
  ages_.splice(ages_.begin(), ages_, known->second.age);
  return known->second.bytes;
}

void KeptBytes::keep(std::uint64_t key, const Bytes& bytes) {
  const std::lock_guard lock(mutex_);
  if (kept_.contains(key)) return;  // another thread was there first
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

}  // namespace blockwalk
