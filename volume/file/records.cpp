// SPDX-License-Identifier: Apache-2.0
#include "volume/file/records.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string_view>

#include "volume/error.h"

namespace blockwalk {
namespace {

template <typename T>
[[noreturn]] void failRecord(const RecordPlace& place, std::uint64_t offset, std::string_view field, const T& value,
                             std::string_view bound) {
  failData("{}: {} record at offset {}: {} is {}, must be {}", place.file, place.name, offset, field, value, bound);
}

// Decodes the records of one channel of a level and refuses what the builder would not have written.
class RecordReader {
 public:
  RecordReader(const RecordPlace& place, const VolumeInfo& info)
      : place_(place), info_(info), channel_(info.channels[place.channel]), entry_(place.entry) {}

  Level read(std::span<const std::byte> block_records, std::span<const std::byte> subblock_records) {
    Level result{.info = info_.levels[place_.level], .blocks = {}, .subblocks = {}};
    result.blocks.reserve(entry_.block_count);
    result.subblocks.reserve(entry_.subblock_count);
    const std::size_t block_bytes = blockRecordBytes(info_.type, info_.block_side);
    for (std::uint64_t i = 0; i < entry_.block_count; ++i) {
      offset_ = entry_.blocks.offset + i * block_bytes;
      Block block = decodeBlockRecord(block_records.data() + i * block_bytes, info_);
      block.first_subblock = result.subblocks.size();
      checkBlock(block, result.info.dims);
      require(result.subblocks.size() + block.subblock_count <= entry_.subblock_count, "subblock count",
              block.subblock_count, "what is left of the level's");
      Summary summary;
      for (int k = 0; k < block.subblock_count; ++k) {
        result.subblocks.push_back(readSubblock(subblock_records, result.subblocks.size(), summary));
      }
      offset_ = entry_.blocks.offset + i * block_bytes;
      if (summary.mask == 0) summary = {.min = 0, .max = 0, .mask = 0};
      require(block.density_min == summary.min, "density min", block.density_min, "the least of its subblocks");
      require(block.density_max == summary.max, "density max", block.density_max, "the greatest of its subblocks");
      require(block.range_mask == summary.mask, "range mask", block.range_mask, "all of its subblocks'");
      result.blocks.push_back(block);
    }
    offset_ = entry_.subblocks.offset;
    require(result.subblocks.size() == entry_.subblock_count, "subblock records of all blocks", result.subblocks.size(),
            "the level's subblock count");
    return result;
  }

 private:
  struct Summary {
    float min = std::numeric_limits<float>::infinity();
    float max = -std::numeric_limits<float>::infinity();
    std::uint8_t mask = 0;
  };

  template <typename T>
  void require(bool holds, std::string_view field, const T& value, std::string_view bound) const {
    if (holds) return;
    failRecord(place_, offset_, field, value, bound);
  }

  void checkBlock(const Block& block, glm::ivec3 dims) {
    const glm::ivec3 blocks = (dims + info_.blockVoxels() - 1) / info_.blockVoxels();
    for (int axis = 0; axis < 3; ++axis) {
      require(block.origin[axis] < blocks[axis], "origin", block.origin[axis],
              fmt::format("below {} on axis {}", blocks[axis], axis));
    }
    const std::uint64_t code = mortonCode(glm::uvec3(block.origin));
    require(block.first_subblock == 0 || code > last_code_, "Morton code of the origin", code,
            fmt::format("above {}, the block's before", last_code_));
    last_code_ = code;
    const std::array<std::uint64_t, 4> inside = insideMask(info_, dims, block.origin);
    int stored = 0;
    for (std::size_t i = 0; i < inside.size(); ++i) {
      require((block.occupancy[i] & ~inside[i]) == 0, "occupancy", block.occupancy[i], "of subblocks inside the level");
      stored += std::popcount(block.occupancy[i]);
    }
    require(block.subblock_count == stored && stored > 0, "subblock count", block.subblock_count,
            fmt::format("at least 1 and the occupancy's, {}", stored));
  }

  Subblock readSubblock(std::span<const std::byte> records, std::size_t index, Summary& summary) {
    const std::size_t bytes = subblockRecordBytes(info_.type);
    offset_ = entry_.subblocks.offset + index * bytes;
    const Subblock subblock = decodeSubblockRecord(records.data() + index * bytes, info_);
    if (subblock.range_mask == 0 && info_.channels.size() > 1) {
      require(subblock.density_min == 0, "density min", subblock.density_min, "0 where the channel is empty");
      require(subblock.density_max == 0, "density max", subblock.density_max, "0 where the channel is empty");
      return subblock;
    }
    require(subblock.density_min > channel_.empty_threshold && std::isfinite(subblock.density_min), "density min",
            subblock.density_min, "finite and above the empty threshold");
    require(subblock.density_max >= subblock.density_min && subblock.density_max <= channel_.density_max, "density max",
            subblock.density_max, "at least the min and at most the volume's");
    const int lo = rangeMaskBin(channel_.bin_cuts, subblock.density_min);
    const int hi = rangeMaskBin(channel_.bin_cuts, subblock.density_max);
    const auto within = static_cast<unsigned>((2 << hi) - (1 << lo));
    const auto ends = static_cast<unsigned>(1 << lo | 1 << hi);
    require((subblock.range_mask & ends) == ends && (subblock.range_mask & ~within) == 0, "range mask",
            subblock.range_mask, "that of its densities");
    summary.min = std::min(summary.min, subblock.density_min);
    summary.max = std::max(summary.max, subblock.density_max);
    summary.mask |= subblock.range_mask;
    return subblock;
  }

  const RecordPlace& place_;
  const VolumeInfo& info_;
  const ChannelInfo& channel_;
  const LevelEntry& entry_;
  std::uint64_t offset_ = 0;  // of the record that is looked at, for messages
  std::uint64_t last_code_ = 0;
};

}  // namespace

Level decodeRecords(const RecordPlace& place, const VolumeInfo& info, std::span<const std::byte> blocks,
                    std::span<const std::byte> subblocks) {
  return RecordReader(place, info).read(blocks, subblocks);
}

void checkSameStructure(const RecordPlace& place, const VolumeInfo& info, std::span<const std::byte> blocks,
                        std::span<const std::byte> first) {
  const std::size_t bytes = blockRecordBytes(info.type, info.block_side);
  for (std::size_t at = 0; at < blocks.size(); at += bytes) {
    const Block own = decodeBlockRecord(blocks.data() + at, info);
    const Block wanted = decodeBlockRecord(first.data() + at, info);
    const std::uint64_t offset = place.entry.blocks.offset + at;
    for (int axis = 0; axis < 3; ++axis) {
      if (own.origin[axis] == wanted.origin[axis]) continue;
      failRecord(place, offset, "origin", own.origin[axis], fmt::format("channel 0's, {}", wanted.origin[axis]));
    }
    for (std::size_t i = 0; i < own.occupancy.size(); ++i) {
      if (own.occupancy[i] == wanted.occupancy[i]) continue;
      failRecord(place, offset, "occupancy", own.occupancy[i], fmt::format("channel 0's, {}", wanted.occupancy[i]));
    }
  }
}

}  // namespace blockwalk
