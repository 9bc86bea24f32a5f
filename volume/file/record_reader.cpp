// SPDX-License-Identifier: Apache-2.0
#include "volume/file/record_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace blockwalk {

RecordReader::RecordReader(const RecordPlace& place, const VolumeInfo& info, SectionReader& section)
    : info_(info),
      dims_(place.info.dims),
      section_(section),
      check_(place, place.entry.blocks.offset),
      end_{.records = place.entry.apron_block_count,
           .blocks = place.entry.block_count,
           .stored = place.entry.subblock_count,
           .all = place.entry.apron_subblock_count} {}

RecordReader::RecordReader(const RecordPlace& place, const VolumeInfo& info, SectionReader& section,
                           const RecordGroup& group, const RecordGroup& next)
    : RecordReader(place, info, section) {
  group_ = &group;
  next_ = &next;
  counts_ = group.before;
  end_ = next.before;
}

bool RecordReader::next(BlockRecord& record) {
  check_.at(section_.offset());
  if (counts_.records == end_.records) {
    finish();
    return false;
  }
  std::span<const std::byte> bytes = section_.ahead(largestBlockRecordBytes(info_.block_side));
  const std::size_t ahead = bytes.size();
  check_(takeBlockRecord(bytes, info_.block_side, record), "block", section_.left(),
         "bytes of an origin and two ascending sets of subblocks, not both empty");
  section_.skip(ahead - bytes.size());
  checkOrigin(record.origin);
  checkSets(record);
  counts_.stored += static_cast<std::uint64_t>(countOf(record.stored));
  counts_.all += static_cast<std::uint64_t>(countOf(record.stored) + countOf(record.beyond));
  counts_.blocks += countOf(record.stored) > 0 ? 1 : 0;
  check_(counts_.stored <= end_.stored && counts_.all <= end_.all, "subblock count", counts_.all,
         "what is left of the level's, or of its group's");
  ++counts_.records;
  return true;
}

void RecordReader::checkOrigin(glm::ivec3 origin) {
  const glm::ivec3 blocks = latticeDims(dims_, info_.blockVoxels());
  for (int axis = 0; axis < 3; ++axis) {
    check_(origin[axis] < blocks[axis], "origin", origin[axis],
           [&] { return fmt::format("below {} on axis {}", blocks[axis], axis); });
  }
  const std::uint64_t code = mortonCode(glm::uvec3(origin));
  check_(!last_code_ || code > *last_code_, "Morton code of the origin", code,
         [&] { return fmt::format("above {}, the block's before", *last_code_); });
  if (group_ != nullptr) {
    check_(last_code_ || code == group_->first_code, "Morton code of the origin", code,
           [&] { return fmt::format("{}, its group's first", group_->first_code); });
    check_(code < next_->first_code, "Morton code of the origin", code,
           [&] { return fmt::format("below {}, the next group's first", next_->first_code); });
  }
  last_code_ = code;
}

void RecordReader::checkSets(const BlockRecord& record) const {
  const SubblockSet inside = insideMask(info_, dims_, record.origin);
  for (std::size_t i = 0; i < inside.size(); ++i) {
    const std::uint64_t set = record.stored[i] | record.beyond[i];
    check_((set & ~inside[i]) == 0, "occupancy", set, "of subblocks inside the level");
    check_((record.stored[i] & record.beyond[i]) == 0, "occupancy beyond", record.beyond[i],
           "of subblocks that are not stored");
  }
}

void RecordReader::finish() const {
  check_(section_.left() == 0, "bytes behind the last block", section_.left(), "0");
  const auto holds = [&](std::uint64_t count, std::uint64_t end, std::string_view field, std::string_view of_level) {
    check_(count == end, field, count, [&] {
      return group_ == nullptr ? std::string(of_level) : fmt::format("{}, where the next group begins", end);
    });
  };
  holds(counts_.stored, end_.stored, "subblocks of all blocks", "the level's subblock_count");
  holds(counts_.all, end_.all, "subblocks of all blocks with an apron", "the level's apron_subblock_count");
  holds(counts_.blocks, end_.blocks, "blocks with stored subblocks", "the level's block_count");
}

RangeReader::RangeReader(const RecordPlace& place, const VolumeInfo& info, Extent extent, SectionReader& section)
    : info_(info),
      channel_(info.channels[place.channel]),
      extent_(extent),
      empty_(emptyValue(info.type, channel_)),
      section_(section),
      bytes_(rangeBytesOf(info.type, extent)),
      check_(place, section.offset()) {}

Subblock RangeReader::next() {
  const std::byte* record = ahead(bytes_).data();
  section_.skip(bytes_);
  return extent_ == Extent::stored ? stored(record) : apron(record);
}

std::span<const std::byte> RangeReader::ahead(std::uint64_t bytes) {
  check_.at(section_.offset());
  check_(bytes <= section_.left(), "ranges", section_.left(), [&] { return fmt::format("{} bytes or more", bytes); });
  return section_.ahead(static_cast<std::size_t>(std::min<std::uint64_t>(bytes, 1u << 20)));
}

void RangeReader::skip(std::uint64_t count) {
  for (std::uint64_t left = count * bytes_; left > 0;) {
    const std::size_t passed = ahead(left).size();
    section_.skip(passed);
    left -= passed;
  }
}

Subblock RangeReader::stored(const std::byte* record) const {
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

Subblock RangeReader::apron(const std::byte* record) const {
  Subblock subblock = decodeApronRange(record, info_.type);
  check_(subblock.density_min >= empty_ && std::isfinite(subblock.density_min), "apron density min",
         subblock.density_min, "finite and at least the empty value");
  check_(subblock.density_max >= subblock.density_min && subblock.density_max <= std::max(channel_.density_max, empty_),
         "apron density max", subblock.density_max, "at least the min and at most the volume's");
  if (subblock.density_max <= channel_.empty_threshold) return subblock;
  // Interpolation passes through every value between the two.
  for (int bin = rangeMaskBin(channel_.bin_cuts, subblock.density_min);
       bin <= rangeMaskBin(channel_.bin_cuts, subblock.density_max); ++bin) {
    subblock.range_mask |= static_cast<std::uint8_t>(1 << bin);
  }
  return subblock;
}

}  // namespace blockwalk
