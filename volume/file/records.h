// SPDX-License-Identifier: Apache-2.0
// The records of one channel of a level: decoded, and held against each other and against the header.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "volume/file/layout.h"

namespace blockwalk {

// Whose records these are. `file` and `name` ("level 1 channel 0") are for messages.
struct RecordPlace {
  const std::string& file;
  std::string name;
  const LevelEntry& entry;
  std::size_t level = 0;
  std::size_t channel = 0;
};

// The level without neighbours. The sections have the sizes that the entry says. Throws DataError that names the
// record's offset, the field and the bound.
Level decodeRecords(const RecordPlace& place, const VolumeInfo& info, std::span<const std::byte> blocks,
                    std::span<const std::byte> subblocks);

// Throws DataError unless origin, subblock count and occupancy of every block are those of `first`, the block records
// of the level's channel 0.
void checkSameStructure(const RecordPlace& place, const VolumeInfo& info, std::span<const std::byte> blocks,
                        std::span<const std::byte> first);

}  // namespace blockwalk
