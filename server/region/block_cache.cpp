// SPDX-License-Identifier: Apache-2.0
#include "server/region/block_cache.h"

#include <algorithm>

namespace blockwalk {

std::shared_ptr<const StoredBlocks> BlockCache::of(const VolumeFile& file, const std::string& identity, int level,
                                                   Form form) {
  {
    const std::lock_guard lock(mutex_);
    const auto known = std::ranges::find_if(entries_, [&](const Entry& entry) {
      return entry.level == level && entry.form == form && entry.step == file.step() && entry.identity == identity;
    });
    if (known != entries_.end()) {
      entries_.splice(entries_.begin(), entries_, known);
      return known->blocks;
    }
  }
  auto blocks = readStoredBlocks(file, level, form);
  if (blocks->bytes() > kMostBytes) return blocks;
  const std::lock_guard lock(mutex_);
  entries_.push_front({.identity = identity, .step = file.step(), .level = level, .form = form, .blocks = blocks});
  std::uint64_t bytes = 0;
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    bytes += entry->blocks->bytes();
    entry = bytes > kMostBytes ? entries_.erase(entry) : std::next(entry);
  }
  return blocks;
}

}  // namespace blockwalk
