// SPDX-License-Identifier: Apache-2.0
// The records of one channel of a level, all of it or those of a window.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "volume/file/record_reader.h"

namespace blockwalk {

// Puts a level together from its records. Throws DataError that names the record's offset, the field and the bound.
class LevelDecoder {
 public:
  // `most`: of all that it will be given.
  LevelDecoder(const RecordPlace& place, Extent extent, const BlockWindow& window, const RecordCounts& most);

  // All records up to the reader's last. `ranges` has those of the extent.
  void add(RecordReader& records, RangeReader& ranges);
  // With neighbours. The counts of its info are those of what was added.
  Level take();

 private:
  Extent extent_;
  BlockWindow window_;
  Level level_;
};

// Runs a decoder of a section's bytes, and throws DataError naming `what` where the section's checksum is another: also
// in place of what the decoder threw.
template <typename Decode>
void withChecksum(const RecordPlace& place, std::string_view what, SectionReader& section, std::uint64_t wanted,
                  Decode decode) {
  const std::uint64_t offset = section.offset();
  const std::uint64_t bytes = section.left();
  const auto check = [&] {
    const std::uint64_t found = section.checksum();
    if (found == wanted) return;
    failData("{}: {} {} at offset {}, {} bytes: checksum is {:016x}, must be {:016x}", place.file, place.name, what,
             offset, bytes, found, wanted);
  };
  try {
    decode();
  } catch (const DataError&) {
    check();
    throw;
  }
  check();
}

// The groups of a level's records, as the file's index has them (volume/file/record_index.h) or as they were found.
class RecordGroups {
 public:
  // Reads all block records of a level once, and holds them against their checksum and the counts.
  RecordGroups(const RecordPlace& place, const VolumeInfo& info, const ReadBytes& read);
  // Those, and behind them the end of the last one.
  RecordGroups(const RecordPlace& place, const VolumeInfo& info, std::vector<RecordGroup> groups)
      : lattice_dims_(latticeDims(place.info.dims, info.blockVoxels())), groups_(std::move(groups)) {}

  std::size_t size() const { return groups_.size() - 1; }
  // [size()] is the end of the last one.
  const RecordGroup& operator[](std::size_t group) const { return groups_[group]; }
  // Those that may have blocks in the window, ascending.
  std::vector<std::size_t> meeting(const BlockWindow& window) const;
  // Of all records in those.
  RecordCounts countsOf(std::span<const std::size_t> groups) const;
  // Of each group the checksum of its ranges; reads all of them once, and holds them against their own.
  std::vector<std::uint64_t> rangeChecksums(const RecordPlace& place, const VolumeInfo& info, Extent extent,
                                            const ReadBytes& read) const;
  // Where a group's ranges begin, in the volume.
  std::uint64_t rangeOffset(const RecordPlace& place, const VolumeInfo& info, Extent extent, std::size_t group) const;

 private:
  glm::ivec3 lattice_dims_;
  std::vector<RecordGroup> groups_;  // and the end of the last one
};

}  // namespace blockwalk
