// SPDX-License-Identifier: Apache-2.0
// A channel's entry in the header of a .bwv file: checks of its bounds, and to and from ChannelInfo.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "volume/error.h"
#include "volume/file/layout.h"

namespace blockwalk {

// Throws DataError for one field of the header. A struct so that checks read as a list.
struct FieldCheck {
  const std::string& file;

  template <typename T>
  void operator()(bool holds, std::string_view field, std::size_t offset, const T& value,
                  std::string_view bound) const {
    if (!holds) failData("{}: header field {} at offset {} is {}, must be {}", file, field, offset, value, bound);
  }
};

// Where a channel's entry stands in the file, and what messages call it.
struct ChannelPlace {
  std::size_t offset = 0;
  std::string prefix;  // "channel 1 "

  std::string name(std::string_view field) const { return fmt::format("{}{}", prefix, field); }
};
// `voxels`: of level 0, in all.
void checkChannel(const ChannelEntry& entry, const ChannelPlace& place, VoxelType type, std::uint64_t voxels,
                  const FieldCheck& check);

// Without what the metadata say.
ChannelInfo channelOf(const ChannelEntry& entry);
ChannelEntry entryOf(const ChannelInfo& channel);

}  // namespace blockwalk
