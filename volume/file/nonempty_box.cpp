// SPDX-License-Identifier: Apache-2.0
#include "volume/file/nonempty_box.h"

#include <utility>

#include "volume/file/records.h"

namespace blockwalk {
namespace {

// Of a block's stored subblocks, in subblocks.
VoxelBox boxOf(const BlockRecord& record, int side) {
  VoxelBox box;
  for (int local = 0; local < side * side * side; ++local) {
    if (!contains(record.stored, local)) continue;
    const glm::ivec3 place = record.origin * side + glm::ivec3(local % side, local / side % side, local / side / side);
    box.include({.begin = place, .end = place + 1});
  }
  return box;
}

bool holds(const VoxelBox& box, const VoxelBox& other) {
  return glm::all(glm::lessThanEqual(box.begin, other.begin)) && glm::all(glm::greaterThanEqual(box.end, other.end));
}

}  // namespace

EntryPlace boxEntry(const DecodedHeader& header, std::uint64_t most_bytes) {
  EntryPlace place;
  const auto levels = static_cast<int>(header.info.levels.size());
  for (int level = 0; level < levels; ++level) {
    // Means may be empty where level 0 is not.
    if (level > 0 && level < kFirstMaximaLevel && !header.info.maxima.empty()) continue;
    place = {.level = level, .form = level > 0 && header.info.has(level, Form::maxima) ? Form::maxima : Form::values};
    if (header.layout.entries[entryIndex(header.info, level, place.form)].blocks.bytes <= most_bytes) break;
  }
  return place;
}

VoxelBox boxOfRecords(const RecordPlace& place, int level, const VolumeInfo& info, const ReadBytes& read) {
  SectionReader section(read, place.entry.blocks.offset, place.entry.blocks.bytes);
  VoxelBox box;  // subblocks of the level
  withChecksum(place, "block records", section, place.entry.blocks.checksum, [&] {
    RecordReader records(place, info, section);
    BlockRecord record;
    while (records.next(record)) {
      const glm::ivec3 begin = record.origin * info.block_side;
      if (!holds(box, {.begin = begin, .end = begin + info.block_side})) box.include(boxOf(record, info.block_side));
    }
  });
  const std::int64_t side = std::int64_t{info.subblock_side} << level;
  const auto voxels = [&](glm::ivec3 place_in_subblocks) {
    return glm::ivec3(glm::min(glm::i64vec3(place_in_subblocks) * side, glm::i64vec3(info.dims)));
  };
  return {.begin = voxels(box.begin), .end = voxels(box.end)};
}

}  // namespace blockwalk
