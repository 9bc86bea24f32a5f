// SPDX-License-Identifier: Apache-2.0
// The records of one channel of a level: decoded, and held against each other and against the header.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "volume/file/layout.h"

namespace blockwalk {

// Whose records these are. `file` and `name` ("level 1 channel 0") are for messages.
struct RecordPlace {
  const std::string& file;
  std::string name;
  const LevelEntry& entry;
  const ChannelSections& sections;
  const LevelInfo& info;
  std::size_t channel = 0;
};

// Which subblocks: those with voxels, or also those of which only the apron has any.
enum class Extent { stored, apron };

// The level without neighbours. `ranges` is the section of that extent; sections have the sizes that the entries say.
// Throws DataError that names the record's offset, the field and the bound.
Level decodeRecords(const RecordPlace& place, const VolumeInfo& info, Extent extent, std::span<const std::byte> blocks,
                    std::span<const std::byte> ranges);

// One page as a reader needs it.
struct Page {
  std::uint64_t checksum = 0;
  std::uint64_t offset = 0;          // in the file
  std::uint64_t first_subblock = 0;  // of the level
  std::uint32_t bytes = 0;           // in the file
  Codec codec = Codec::raw;
  std::uint8_t subblocks = 0;
};
// The pages of one channel of a level. Throws DataError as above.
std::vector<Page> decodePages(const RecordPlace& place, const VolumeInfo& info, std::span<const std::byte> pages);

// Throws DataError unless each block has the page that its subblocks need.
void checkPages(const RecordPlace& place, const Level& level, std::span<const Page> pages);

}  // namespace blockwalk
