// SPDX-License-Identifier: Apache-2.0
#include "volume/file/records.h"

#include <algorithm>
#include <utility>

namespace blockwalk {
namespace {

// Extends a block's range by a subblock's. Where the apron's lies, an empty channel has a range as well.
void include(Block& block, const Subblock& subblock, Extent extent, bool& any) {
  if (extent == Extent::stored && subblock.range_mask == 0) return;
  block.density_min = any ? std::min(block.density_min, subblock.density_min) : subblock.density_min;
  block.density_max = any ? std::max(block.density_max, subblock.density_max) : subblock.density_max;
  block.range_mask |= subblock.range_mask;
  any = true;
}

struct CodeRange {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
};

// Ranges of Morton codes, ascending, in which those of a window lie, few others, and not many ranges: cells of an
// octree down to an eighth of the window's side.
class WindowCodes {
 public:
  WindowCodes(const BlockWindow& window, glm::ivec3 lattice_dims)
      : begin_(glm::max(window.begin, glm::ivec3(0))), end_(glm::min(window.end, lattice_dims)) {
    if (glm::any(glm::lessThanEqual(end_, begin_))) return;
    const glm::ivec3 size = end_ - begin_;
    const int side = std::max({size.x, size.y, size.z});
    while ((1 << smallest_) < side / 8) ++smallest_;
    int depth = 0;
    while ((1 << depth) < std::max({lattice_dims.x, lattice_dims.y, lattice_dims.z})) ++depth;
    add(glm::ivec3(0), std::max(depth, smallest_));
  }
  const std::vector<CodeRange>& ranges() const { return ranges_; }

 private:
  void add(glm::ivec3 corner, int depth) {
    const glm::ivec3 far = corner + (1 << depth);
    if (glm::any(glm::greaterThanEqual(corner, end_)) || glm::any(glm::lessThanEqual(far, begin_))) return;
    const bool inside = glm::all(glm::greaterThanEqual(corner, begin_)) && glm::all(glm::lessThanEqual(far, end_));
    if (inside || depth == smallest_) {
      const std::uint64_t code = mortonCode(glm::uvec3(corner));
      const std::uint64_t end = code + (std::uint64_t{1} << (3 * depth));
      if (!ranges_.empty() && ranges_.back().end == code) {
        ranges_.back().end = end;
      } else {
        ranges_.push_back({.begin = code, .end = end});
      }
      return;
    }
    for (int i = 0; i < 8; ++i) add(corner + glm::ivec3(i & 1, i >> 1 & 1, i >> 2) * (1 << (depth - 1)), depth - 1);
  }

  glm::ivec3 begin_;
  glm::ivec3 end_;
  int smallest_ = 0;
  std::vector<CodeRange> ranges_;
};

}  // namespace

LevelDecoder::LevelDecoder(const RecordPlace& place, Extent extent, const BlockWindow& window, const RecordCounts& most)
    : extent_(extent), window_(window), level_{.info = place.info, .blocks = {}, .subblocks = {}} {
  // Of much of it what is not touched takes no memory.
  const bool stored = extent == Extent::stored;
  level_.blocks.reserve(stored ? most.blocks : most.records);
  level_.subblocks.reserve(stored ? most.stored : most.all);
}

void LevelDecoder::add(RecordReader& records, RangeReader& ranges) {
  const bool stored = extent_ == Extent::stored;
  BlockRecord record;
  while (records.next(record)) {
    Block block;
    block.origin = record.origin;
    block.stored = record.stored;
    block.first_stored = records.counts().stored - static_cast<std::uint64_t>(countOf(record.stored));
    for (std::size_t i = 0; i < block.occupancy.size(); ++i) {
      block.occupancy[i] = record.stored[i] | (stored ? 0 : record.beyond[i]);
    }
    block.subblock_count = static_cast<std::uint16_t>(countOf(block.occupancy));
    if (block.subblock_count == 0) continue;
    if (!window_.contains(block.origin)) {
      ranges.skip(block.subblock_count);
      continue;
    }
    block.first_subblock = level_.subblocks.size();
    bool any = false;
    for (int i = 0; i < block.subblock_count; ++i) {
      level_.subblocks.push_back(ranges.next());
      include(block, level_.subblocks.back(), extent_, any);
    }
    level_.blocks.push_back(block);
  }
}

Level LevelDecoder::take() {
  // Few of those that there might have been: what was reserved goes back.
  if (level_.blocks.capacity() > 2 * level_.blocks.size()) level_.blocks.shrink_to_fit();
  if (level_.subblocks.capacity() > 2 * level_.subblocks.size()) level_.subblocks.shrink_to_fit();
  linkNeighbours(level_.blocks);
  level_.info.block_count = level_.blocks.size();
  level_.info.subblock_count = level_.subblocks.size();
  return std::move(level_);
}

RecordGroups::RecordGroups(const RecordPlace& place, const VolumeInfo& info, const ReadBytes& read)
    : lattice_dims_(latticeDims(place.info.dims, info.blockVoxels())) {
  SectionReader section(read, place.entry.blocks.offset, place.entry.blocks.bytes);
  withChecksum(place, "block records", section, place.entry.blocks.checksum, [&] {
    RecordReader records(place, info, section);
    BlockRecord record;
    RunningChecksum checksum;
    while (true) {
      const RecordCounts before = records.counts();
      const std::uint64_t offset = section.offset();
      const std::span<const std::byte> ahead = section.ahead(largestBlockRecordBytes(info.block_side));
      const bool more = records.next(record);
      const bool begins = before.records % kGroupRecords == 0;
      if ((begins || !more) && !groups_.empty()) groups_.back().checksum = checksum.value();
      if (!more) break;
      if (begins) {
        groups_.push_back(
            {.first_code = mortonCode(glm::uvec3(record.origin)), .offset = offset, .checksum = 0, .before = before});
        checksum.reset();
      }
      checksum.add(ahead.first(section.offset() - offset));
    }
    groups_.push_back({.first_code = kNoCode, .offset = section.offset(), .checksum = 0, .before = records.counts()});
  });
}

std::vector<std::size_t> RecordGroups::meeting(const BlockWindow& window) const {
  std::vector<std::size_t> met;
  const WindowCodes codes(window, lattice_dims_);
  std::size_t group = 0;
  for (const CodeRange& range : codes.ranges()) {
    const auto behind = [&](std::uint64_t code) {
      return static_cast<std::size_t>(std::ranges::lower_bound(groups_, code, {}, &RecordGroup::first_code) -
                                      groups_.begin());
    };
    // The one before the first that begins behind the range's begin may reach into it.
    const std::size_t first = behind(range.begin + 1);
    group = std::max(group, first == 0 ? 0 : first - 1);
    for (const std::size_t end = std::min(behind(range.end), size()); group < end; ++group) met.push_back(group);
  }
  return met;
}

RecordCounts RecordGroups::countsOf(std::span<const std::size_t> groups) const {
  RecordCounts sum;
  for (const std::size_t group : groups) {
    const RecordCounts& begin = groups_[group].before;
    const RecordCounts& end = groups_[group + 1].before;
    sum.records += end.records - begin.records;
    sum.blocks += end.blocks - begin.blocks;
    sum.stored += end.stored - begin.stored;
    sum.all += end.all - begin.all;
  }
  return sum;
}

std::uint64_t RecordGroups::rangeOffset(const RecordPlace& place, const VolumeInfo& info, Extent extent,
                                        std::size_t group) const {
  const RecordCounts& before = groups_[group].before;
  return rangeSection(place, extent).offset +
         (extent == Extent::stored ? before.stored : before.all) * rangeBytesOf(info.type, extent);
}

std::vector<std::uint64_t> RecordGroups::rangeChecksums(const RecordPlace& place, const VolumeInfo& info, Extent extent,
                                                        const ReadBytes& read) const {
  const Section& ranges = rangeSection(place, extent);
  SectionReader section(read, ranges.offset, ranges.bytes);
  std::vector<std::uint64_t> checksums;
  withChecksum(place, extent == Extent::stored ? "ranges" : "apron ranges", section, ranges.checksum, [&] {
    for (std::size_t i = 0; i < size(); ++i) {
      RunningChecksum checksum;
      for (std::uint64_t left = rangeOffset(place, info, extent, i + 1) - section.offset(); left > 0;) {
        const auto bytes = section.ahead(static_cast<std::size_t>(std::min<std::uint64_t>(left, 1u << 20)));
        checksum.add(bytes);
        section.skip(bytes.size());
        left -= bytes.size();
      }
      checksums.push_back(checksum.value());
    }
  });
  return checksums;
}

}  // namespace blockwalk
