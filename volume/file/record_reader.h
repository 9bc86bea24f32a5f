// SPDX-License-Identifier: Apache-2.0
// The records of blocks and of subblocks' densities one after the other, held against each other, the counts and the
// header.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "volume/error.h"
#include "volume/file/layout.h"
#include "volume/file/section_reader.h"

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
enum class Extent : std::uint8_t { stored, apron };

// Where the ranges of an extent lie, and how long one is.
inline const Section& rangeSection(const RecordPlace& place, Extent extent) {
  return extent == Extent::stored ? place.sections.ranges : place.sections.apron_ranges;
}
inline std::size_t rangeBytesOf(VoxelType type, Extent extent) {
  return extent == Extent::stored ? rangeBytes(type) : apronRangeBytes(type);
}

// Judges fields of the record, or what else it is, at one offset. A bound is text, or makes it when it is asked for:
// nearly all hold.
class RecordCheck {
 public:
  RecordCheck(const RecordPlace& place, std::uint64_t offset, const char* what = "record")
      : place_(place), offset_(offset), what_(what) {}

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
    failData("{}: {} {} at offset {}: {} is {}, must be {}", place_.file, place_.name, what_, offset_, field, value,
             text);
  }

 private:
  const RecordPlace& place_;
  std::uint64_t offset_;
  const char* what_;
};

// Of the records before some one: how many, how many of them have voxels, and of how many subblocks they are.
struct RecordCounts {
  std::uint64_t records = 0;
  std::uint64_t blocks = 0;
  std::uint64_t stored = 0;
  std::uint64_t all = 0;  // those that are stored, and those of which the apron has voxels
  bool operator==(const RecordCounts&) const = default;
};

// Above the Morton code of every block: where the last group ends.
constexpr std::uint64_t kNoCode = std::numeric_limits<std::uint64_t>::max();

// Where records lie, by groups of kGroupRecords, so that those of a window are read without all the others. A group has
// its own checksum.
struct RecordGroup {
  std::uint64_t first_code = 0;  // Morton code of its first block
  std::uint64_t offset = 0;      // of its first record, in the volume
  std::uint64_t checksum = 0;
  RecordCounts before;
};

// Reads block records one by one and refuses what the builder would not have written.
class RecordReader {
 public:
  // Of all of a level.
  RecordReader(const RecordPlace& place, const VolumeInfo& info, SectionReader& section);
  // Of one group of it, up to where the next begins.
  RecordReader(const RecordPlace& place, const VolumeInfo& info, SectionReader& section, const RecordGroup& group,
               const RecordGroup& next);

  // False after the last.
  bool next(BlockRecord& record);
  // With the one read last.
  const RecordCounts& counts() const { return counts_; }

 private:
  void checkOrigin(glm::ivec3 origin);
  void checkSets(const BlockRecord& record) const;
  void finish() const;

  const VolumeInfo& info_;
  glm::ivec3 dims_;
  SectionReader& section_;
  RecordCheck check_;
  const RecordGroup* group_ = nullptr;  // null: all of the level
  const RecordGroup* next_ = nullptr;
  RecordCounts counts_;
  RecordCounts end_;
  std::optional<std::uint64_t> last_code_;
};

// Reads the ranges of one channel, and refuses what the builder would not have written.
class RangeReader {
 public:
  // Throws DataError where more are read than the section has.
  RangeReader(const RecordPlace& place, const VolumeInfo& info, Extent extent, SectionReader& section);

  Subblock next();
  void skip(std::uint64_t count);

 private:
  std::span<const std::byte> ahead(std::uint64_t bytes);
  Subblock stored(const std::byte* record) const;
  Subblock apron(const std::byte* record) const;

  const VolumeInfo& info_;
  const ChannelInfo& channel_;
  Extent extent_;
  float empty_;
  SectionReader& section_;
  std::size_t bytes_;
  RecordCheck check_;
};

}  // namespace blockwalk
