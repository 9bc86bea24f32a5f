// SPDX-License-Identifier: Apache-2.0
// What a file says of where groups of a level's records lie, so that a window of many is opened without a look at all
// of them. docs/format.md has the bytes; a level of few records has none of this, and neither have files that were
// written before there was such a thing: there it is found by reading all.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "volume/file/page_table.h"
#include "volume/file/records.h"

namespace blockwalk {

// Of one channel. By group: of its ranges and apron ranges the checksums; where its pages lie, and behind them the end.
struct ChannelGroups {
  std::vector<std::uint64_t> ranges;
  std::vector<std::uint64_t> apron_ranges;
  std::vector<PageGroup> pages;

  const std::vector<std::uint64_t>& of(Extent extent) const { return extent == Extent::stored ? ranges : apron_ranges; }
};

struct RecordIndex {
  RecordGroups records;
  std::vector<ChannelGroups> channels;
};

// From the records themselves: reads all of them once and holds them against their checksums. `channels` has the place
// of each. Throws DataError as their readers do.
RecordIndex findIndex(std::span<const RecordPlace> channels, const VolumeInfo& info, const ReadBytes& read);

// The section's bytes.
std::vector<std::byte> encodeIndex(const RecordIndex& index, std::span<const RecordPlace> channels);

// Reads the section, and refuses what no records can have: throws DataError that names the group's offset, the field
// and the bound. Whether it is true of the records is told when those are read.
RecordIndex readIndex(std::span<const RecordPlace> channels, const VolumeInfo& info, const Section& section,
                      const ReadBytes& read);

}  // namespace blockwalk
