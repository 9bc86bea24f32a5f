// SPDX-License-Identifier: Apache-2.0
#include "volume/file/records.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>
#include <type_traits>

#include "volume/error.h"

namespace blockwalk {
namespace {

// Judges fields of the record at one offset. A bound is text, or makes it when it is asked for: nearly all hold.
class RecordCheck {
 public:
  RecordCheck(const RecordPlace& place, std::uint64_t offset) : place_(place), offset_(offset) {}

  void at(std::uint64_t offset) { offset_ = offset; }

  template <typename T, typename Bound>
  void operator()(bool holds, std::string_view field, const T& value, Bound bound) const {
    if (holds) return;
    std::string text;
    if constexpr (std::is_invocable_v<Bound>) {
      text = bound();
    } else {
      text = bound;
    }
    failData("{}: {} record at offset {}: {} is {}, must be {}", place_.file, place_.name, offset_, field, value, text);
  }

 private:
  const RecordPlace& place_;
  std::uint64_t offset_;
};

// Reads the block records one by one and refuses what the builder would not have written.
class BlockReader {
 public:
  BlockReader(const RecordPlace& place, const VolumeInfo& info, std::span<const std::byte> records)
      : info_(info),
        entry_(place.entry),
        dims_(place.info.dims),
        records_(records),
        bytes_(records.size()),
        check_(place, place.entry.blocks.offset) {}

  // False after the last.
  bool next(BlockRecord& record) {
    check_.at(entry_.blocks.offset + bytes_ - records_.size());
    if (read_ == entry_.apron_block_count) {
      finish();
      return false;
    }
    const std::size_t left = records_.size();
    check_(takeBlockRecord(records_, info_.block_side, record), "block", left,
           "bytes of an origin and two ascending sets of subblocks, not both empty");
    checkOrigin(record.origin);
    checkSets(record);
    stored_ += static_cast<std::uint64_t>(countOf(record.stored));
    all_ += static_cast<std::uint64_t>(countOf(record.stored) + countOf(record.beyond));
    blocks_ += countOf(record.stored) > 0 ? 1 : 0;
    check_(stored_ <= entry_.subblock_count && all_ <= entry_.apron_subblock_count, "subblock count", all_,
           "what is left of the level's");
    ++read_;
    return true;
  }

 private:
  void checkOrigin(glm::ivec3 origin) {
    const glm::ivec3 blocks = (dims_ + info_.blockVoxels() - 1) / info_.blockVoxels();
    for (int axis = 0; axis < 3; ++axis) {
      check_(origin[axis] < blocks[axis], "origin", origin[axis],
             [&] { return fmt::format("below {} on axis {}", blocks[axis], axis); });
    }
    const std::uint64_t code = mortonCode(glm::uvec3(origin));
    check_(read_ == 0 || code > last_code_, "Morton code of the origin", code,
           [&] { return fmt::format("above {}, the block's before", last_code_); });
    last_code_ = code;
  }

  void checkSets(const BlockRecord& record) const {
    const SubblockSet inside = insideMask(info_, dims_, record.origin);
    for (std::size_t i = 0; i < inside.size(); ++i) {
      const std::uint64_t set = record.stored[i] | record.beyond[i];
      check_((set & ~inside[i]) == 0, "occupancy", set, "of subblocks inside the level");
      check_((record.stored[i] & record.beyond[i]) == 0, "occupancy beyond", record.beyond[i],
             "of subblocks that are not stored");
    }
  }

  void finish() const {
    check_(records_.empty(), "bytes behind the last block", records_.size(), "0");
    check_(stored_ == entry_.subblock_count, "subblocks of all blocks", stored_, "the level's subblock_count");
    check_(all_ == entry_.apron_subblock_count, "subblocks of all blocks with an apron", all_,
           "the level's apron_subblock_count");
    check_(blocks_ == entry_.block_count, "blocks with stored subblocks", blocks_, "the level's block_count");
  }

  const VolumeInfo& info_;
  const LevelEntry& entry_;
  glm::ivec3 dims_;
  std::span<const std::byte> records_;
  std::size_t bytes_;
  RecordCheck check_;
  std::uint64_t read_ = 0;
  std::uint64_t last_code_ = 0;
  std::uint64_t stored_ = 0;
  std::uint64_t all_ = 0;
  std::uint64_t blocks_ = 0;
};

// Reads the ranges of one channel, and refuses what the builder would not have written.
class RangeReader {
 public:
  RangeReader(const RecordPlace& place, const VolumeInfo& info, Extent extent, std::span<const std::byte> ranges)
      : info_(info),
        channel_(info.channels[place.channel]),
        extent_(extent),
        empty_(emptyValue(info.type, channel_)),
        offset_(extent == Extent::stored ? place.sections.ranges.offset : place.sections.apron_ranges.offset),
        ranges_(ranges),
        check_(place, offset_) {}

  Subblock next() {
    const std::size_t bytes = extent_ == Extent::stored ? rangeBytes(info_.type) : apronRangeBytes(info_.type);
    check_.at(offset_ + at_);
    const std::byte* record = ranges_.data() + at_;
    at_ += bytes;
    return extent_ == Extent::stored ? stored(record) : apron(record);
  }

 private:
  Subblock stored(const std::byte* record) const {
    const Subblock subblock = decodeRange(record, info_.type);
    if (subblock.range_mask == 0 && info_.channels.size() > 1) {
      check_(subblock.density_min == 0, "density min", subblock.density_min, "0 where the channel is empty");
      check_(subblock.density_max == 0, "density max", subblock.density_max, "0 where the channel is empty");
      return subblock;
    }
    check_(subblock.density_min > channel_.empty_threshold && std::isfinite(subblock.density_min), "density min",
           subblock.density_min, "finite and above the empty threshold");
    check_(subblock.density_max >= subblock.density_min && subblock.density_max <= channel_.density_max, "density max",
           subblock.density_max, "at least the min and at most the volume's");
    const int lo = rangeMaskBin(channel_.bin_cuts, subblock.density_min);
    const int hi = rangeMaskBin(channel_.bin_cuts, subblock.density_max);
    const auto within = static_cast<unsigned>((2 << hi) - (1 << lo));
    const auto ends = static_cast<unsigned>(1 << lo | 1 << hi);
    check_((subblock.range_mask & ends) == ends && (subblock.range_mask & ~within) == 0, "range mask",
           subblock.range_mask, "that of its densities");
    return subblock;
  }

  Subblock apron(const std::byte* record) const {
    Subblock subblock = decodeApronRange(record, info_.type);
    check_(subblock.density_min >= empty_ && std::isfinite(subblock.density_min), "apron density min",
           subblock.density_min, "finite and at least the empty value");
    check_(
        subblock.density_max >= subblock.density_min && subblock.density_max <= std::max(channel_.density_max, empty_),
        "apron density max", subblock.density_max, "at least the min and at most the volume's");
    if (subblock.density_max <= channel_.empty_threshold) return subblock;
    // Interpolation passes through every value between the two.
    for (int bin = rangeMaskBin(channel_.bin_cuts, subblock.density_min);
         bin <= rangeMaskBin(channel_.bin_cuts, subblock.density_max); ++bin) {
      subblock.range_mask |= static_cast<std::uint8_t>(1 << bin);
    }
    return subblock;
  }

  const VolumeInfo& info_;
  const ChannelInfo& channel_;
  Extent extent_;
  float empty_;
  std::uint64_t offset_;
  std::span<const std::byte> ranges_;
  std::size_t at_ = 0;
  RecordCheck check_;
};

// Extends a block's range by a subblock's. Where the apron's lies, an empty channel has a range as well.
void include(Block& block, const Subblock& subblock, Extent extent, bool& any) {
  if (extent == Extent::stored && subblock.range_mask == 0) return;
  block.density_min = any ? std::min(block.density_min, subblock.density_min) : subblock.density_min;
  block.density_max = any ? std::max(block.density_max, subblock.density_max) : subblock.density_max;
  block.range_mask |= subblock.range_mask;
  any = true;
}

}  // namespace

Level decodeRecords(const RecordPlace& place, const VolumeInfo& info, Extent extent, std::span<const std::byte> blocks,
                    std::span<const std::byte> ranges) {
  const LevelEntry& entry = place.entry;
  const bool stored = extent == Extent::stored;
  Level result{.info = place.info, .blocks = {}, .subblocks = {}};
  result.blocks.reserve(stored ? entry.block_count : entry.apron_block_count);
  result.subblocks.reserve(stored ? entry.subblock_count : entry.apron_subblock_count);
  BlockReader block_reader(place, info, blocks);
  RangeReader range_reader(place, info, extent, ranges);
  BlockRecord record;
  while (block_reader.next(record)) {
    Block block;
    block.origin = record.origin;
    for (std::size_t i = 0; i < block.occupancy.size(); ++i) {
      block.occupancy[i] = record.stored[i] | (stored ? 0 : record.beyond[i]);
    }
    block.subblock_count = static_cast<std::uint16_t>(countOf(block.occupancy));
    if (block.subblock_count == 0) continue;
    block.first_subblock = result.subblocks.size();
    bool any = false;
    for (int i = 0; i < block.subblock_count; ++i) {
      result.subblocks.push_back(range_reader.next());
      include(block, result.subblocks.back(), extent, any);
    }
    result.blocks.push_back(block);
  }
  return result;
}

std::vector<Page> decodePages(const RecordPlace& place, const VolumeInfo& info, std::span<const std::byte> pages) {
  const std::uint64_t subblock_bytes = info.subblockVoxels() * voxelBytes(info.type);
  const int per_block = info.block_side * info.block_side * info.block_side;
  std::vector<Page> result;
  result.reserve(pages.size() / sizeof(PageEntry));
  RecordCheck check(place, place.sections.pages.offset);
  std::uint64_t bytes = 0;
  std::uint64_t subblocks = 0;
  for (std::size_t at = 0; at < pages.size(); at += sizeof(PageEntry)) {
    PageEntry entry;
    std::memcpy(&entry, pages.data() + at, sizeof entry);
    check.at(place.sections.pages.offset + at);
    check(entry.codec < kCodecs, "page codec", entry.codec, "0 (raw), 1 (lz4) or 2 (zstd)");
    check(entry.reserved == 0, "page reserved", entry.reserved, "0");
    check(entry.subblocks >= 1 && entry.subblocks <= per_block, "page subblocks", entry.subblocks,
          [&] { return fmt::format("1..{}", per_block); });
    const auto codec = static_cast<Codec>(entry.codec);
    const std::uint64_t unpacked = entry.subblocks * subblock_bytes;
    check(codec == Codec::raw ? entry.bytes == unpacked : entry.bytes > 0 && entry.bytes < unpacked, "page bytes",
          entry.bytes, [&] {
            return codec == Codec::raw ? fmt::format("{}, of {} subblocks", unpacked, entry.subblocks)
                                       : fmt::format("1..{}, packed from {}", unpacked - 1, unpacked);
          });
    result.push_back({.checksum = entry.checksum,
                      .offset = place.sections.voxels.offset + bytes,
                      .first_subblock = subblocks,
                      .bytes = entry.bytes,
                      .codec = codec,
                      .subblocks = entry.subblocks});
    bytes += entry.bytes;
    subblocks += entry.subblocks;
  }
  check(subblocks == place.entry.subblock_count, "subblocks of all pages", subblocks, "the level's subblock_count");
  check(bytes == place.sections.voxels.bytes, "bytes of all pages", bytes, "the size of the voxels");
  return result;
}

void checkPages(const RecordPlace& place, const Level& level, std::span<const Page> pages) {
  RecordCheck check(place, place.sections.pages.offset);
  for (std::size_t i = 0; i < level.blocks.size(); ++i) {
    check.at(place.sections.pages.offset + i * sizeof(PageEntry));
    check(pages[i].first_subblock == level.blocks[i].first_subblock, "page's first subblock", pages[i].first_subblock,
          [&] { return fmt::format("its block's, {}", level.blocks[i].first_subblock); });
  }
}

}  // namespace blockwalk
