// SPDX-License-Identifier: Apache-2.0
// Which blocks the levels have that regions were read of last: many small regions of one level read them once.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>

#include "volume/export/box_reader.h"

namespace blockwalk {

// Of all threads.
class BlockCache {
 public:
  // The newest stay, as many as fit; what is larger is not kept.
  static constexpr std::uint64_t kMostBytes = std::uint64_t{64} << 20;

  // `identity` is the content's. Throws what VolumeFile throws.
  std::shared_ptr<const StoredBlocks> of(const VolumeFile& file, const std::string& identity, int level,
                                         Form form = Form::values);

 private:
  struct Entry {
    std::string identity;
    int step = 0;
    int level = 0;
    Form form = Form::values;
    std::shared_ptr<const StoredBlocks> blocks;
  };
  std::mutex mutex_;          // guards the entries
  std::list<Entry> entries_;  // the newest first
};

}  // namespace blockwalk
