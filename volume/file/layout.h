// SPDX-License-Identifier: Apache-2.0
// The byte map of a .bwv file, version 3. Everything is little endian. docs/format.md says the same in prose.
//
//   FileHeader                     192 bytes
//   LevelEntry x entries           72 bytes each: the levels' values, level 0 first, then the maxima of level 2 and on
//   ChannelSections x entries x channels  96 bytes each, in the order of the entries, inside one channel 0 first
//   ChannelEntry x channels        2144 bytes each
//   metadata                       FileHeader::metadata_bytes of text: volume/file/metadata.h
//   records: for each level, coarsest first, values before maxima, each section at the next multiple of 64, zeros
//   between:
//     block records                of all channels, apron_block_count records in Morton order of origin
//     index                        where header.group_records is not 0 and the level has more records than that:
//                                  IndexGroup, IndexPart x channels for each so many of them; u64 XXH3-64 of those
//     for each channel:
//       ranges                     subblock_count x rangeBytes, block after block, in local raster order
//       apron ranges               apron_subblock_count x apronRangeBytes, in the same order
//       pages                      PageEntry x block_count: of each stored block, in their order
//   voxels: for each level, coarsest first, values before maxima, for each channel, a section at the next multiple of
//   64:
//     pages                        of each stored block, packed as its PageEntry says: subblock_count x side^3 x
//                                  voxelBytes, x fastest; beyond the level's dims: zeros
//   end of file: nothing follows the voxels of the last channel of level 0
//
//   block record     u16 origin[3] in blocks | u8 stored | u8 beyond | set of `stored` | set of `beyond` local
//   subblocks
//                    stored: those that have voxels; beyond: those that have none, and whose apron has
//   set              of fewer local subblocks than ceil(block_side^3 / 8): a u8 each, ascending; of more: as many bytes
//                    as that, bit i of byte i/8 is local subblock i
//   range            D density min | D density max | u8 range mask; 0, 0, 0 where the channel has no non-empty voxel
//   apron range      D density min | D density max
//   D is the density as it is stored: u8 for rgba8 and u8, u16 for u16, f32 for f32.
//
// A local subblock is x + block_side * (y + block_side * z). A subblock's apron is the one-voxel ring around it. What
// follows from the order is not stored: neighbours, first subblocks, ranges and masks of blocks, masks of aprons.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "volume/volume.h"

namespace blockwalk {

static_assert(std::endian::native == std::endian::little, "records are copied as they lie in memory");

constexpr std::array<char, 8> kFileMagic = {'B', 'W', 'V', 'O', 'L', '\r', '\n', '\x1a'};
constexpr std::uint32_t kFileVersion = 3;
constexpr std::uint64_t kSectionAlignment = 64;
constexpr std::uint64_t kMaxSubblocks = 0xfffffffe;  // of a level: a kernel counts them in 32 bits

// The values of one channel.
struct ChannelFields {
  double value_scale = 0;
  double value_offset = 0;
  double largest_rounding = 0;
  std::uint64_t nonempty_voxels = 0;
  std::uint64_t nonfinite_voxels = 0;
  float empty_threshold = 0;
  float density_min = 0;
  float density_max = 0;
  float histogram_lo = 0;
  float histogram_hi = 0;
  std::array<float, kRangeMaskBins - 1> bin_cuts{};
  std::array<std::uint64_t, kHistogramBins> histogram{};
};
static_assert(sizeof(ChannelFields) == 2136 && offsetof(ChannelFields, bin_cuts) == 60 &&
              offsetof(ChannelFields, histogram) == 88);

struct FileHeader {
  std::array<char, 8> magic{};
  std::uint32_t version = 0;
  std::uint32_t header_bytes = 0;  // FileHeader, entries and metadata
  std::uint64_t file_bytes = 0;
  std::uint64_t header_checksum = 0;  // XXH3-64 of the header_bytes with this field zero
  std::uint8_t type = 0;              // VoxelType
  std::uint8_t subblock_side = 0;
  std::uint8_t block_side = 0;
  std::uint8_t level_count = 0;
  std::array<std::uint32_t, 3> dims{};
  std::array<double, 12> world_from_index{};  // the first three rows, row after row; the fourth is 0 0 0 1
  std::uint32_t channel_count = 0;
  std::uint32_t metadata_bytes = 0;
  // Room for being a part of a larger volume; all 0 so far.
  std::array<std::uint32_t, 3> part_origin{};  // of this volume's first voxel in the whole
  std::array<std::uint32_t, 3> whole_dims{};
  std::uint32_t time_step = 0;
  std::uint32_t time_steps = 0;
  std::uint32_t maxima_count = 0;   // levels that have maxima: none, or all from level 2 on
  std::uint32_t group_records = 0;  // of an index: kGroupRecords, or 0 where no level has one
};
static_assert(sizeof(FileHeader) == 192 && offsetof(FileHeader, dims) == 36 &&
              offsetof(FileHeader, world_from_index) == 48 && offsetof(FileHeader, channel_count) == 144 &&
              offsetof(FileHeader, part_origin) == 152);

struct ChannelEntry {
  ChannelFields fields;
  std::uint8_t values = 0;  // ChannelValues
  std::array<std::uint8_t, 7> reserved{};
};
static_assert(sizeof(ChannelEntry) == 2144 && offsetof(ChannelEntry, values) == 2136);

struct Section {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::uint64_t checksum = 0;  // XXH3-64; of voxels 0, their pages have their own
};

// What all channels of a level share, in one form.
struct LevelEntry {
  std::array<std::uint32_t, 3> dims{};
  std::uint32_t reserved = 0;
  std::uint64_t block_count = 0;           // with stored subblocks
  std::uint64_t subblock_count = 0;        // stored
  std::uint64_t apron_block_count = 0;     // with subblocks that are stored or beyond: all records
  std::uint64_t apron_subblock_count = 0;  // stored and beyond
  Section blocks;
};
static_assert(sizeof(LevelEntry) == 72 && sizeof(Section) == 24);

struct ChannelSections {
  Section ranges;
  Section apron_ranges;
  Section pages;
  Section voxels;
};
static_assert(sizeof(ChannelSections) == 96);

// What is read at once: the voxels of one stored block in one channel. Pages follow each other without gaps.
struct PageEntry {
  std::uint64_t checksum = 0;  // XXH3-64 of the bytes in the file, as they are packed
  std::uint32_t bytes = 0;     // in the file; packed: fewer than unpacked
  std::uint8_t codec = 0;      // Codec
  std::uint8_t subblocks = 0;  // the block's stored ones
  std::uint16_t reserved = 0;
};
static_assert(sizeof(PageEntry) == 16);

// Where a group of records lies, so that those of a window are read without all the others: kGroupRecords of them, the
// last of a level fewer.
constexpr std::uint64_t kGroupRecords = 1024;
struct IndexGroup {
  std::uint64_t first_code = 0;  // Morton code of its first block
  std::uint64_t offset = 0;      // of its first record, in the block records
  std::uint64_t checksum = 0;    // XXH3-64 of its block records
  std::uint64_t blocks = 0;      // of the records before it: those with stored subblocks
  std::uint64_t stored = 0;      // their stored subblocks
  std::uint64_t all = 0;         // their subblocks that are stored and beyond
};
static_assert(sizeof(IndexGroup) == 48);

// The same of one channel.
struct IndexPart {
  std::uint64_t ranges = 0;        // XXH3-64 of its ranges
  std::uint64_t apron_ranges = 0;  // of its apron ranges
  std::uint64_t pages = 0;         // of its PageEntries
  std::uint64_t page_offset = 0;   // of its first page, in the voxels
};
static_assert(sizeof(IndexPart) == 32);

// Of a level with so many records; 0 where it has no index.
std::uint64_t indexBytes(std::uint64_t records, std::size_t channels);

// Bytes of one stored density.
std::size_t densityBytes(VoxelType type);
std::size_t rangeBytes(VoxelType type);
std::size_t apronRangeBytes(VoxelType type);

// The least and greatest size of a block record.
constexpr std::size_t kLeastBlockRecordBytes = 9;
std::size_t largestBlockRecordBytes(int block_side);

using SubblockSet = std::array<std::uint64_t, 4>;  // bit i: local subblock i
inline int countOf(const SubblockSet& set) {
  return std::popcount(set[0]) + std::popcount(set[1]) + std::popcount(set[2]) + std::popcount(set[3]);
}
inline bool contains(const SubblockSet& set, int local) {
  return (set[static_cast<std::size_t>(local) / 64] >> (local % 64) & 1u) != 0;
}
inline void insert(SubblockSet& set, int local) {
  set[static_cast<std::size_t>(local) / 64] |= std::uint64_t{1} << (local % 64);
}

struct BlockRecord {
  glm::ivec3 origin{0};  // blocks
  SubblockSet stored{};
  SubblockSet beyond{};
};
// Appends one record. Densities are exact in the stored width.
void appendBlockRecord(std::vector<std::byte>& out, int block_side, const BlockRecord& record);
void appendDensity(std::vector<std::byte>& out, VoxelType type, float density);
void appendRange(std::vector<std::byte>& out, VoxelType type, const Subblock& subblock);

// Reads one record from the front of `records` and takes it away. False where it is cut off or not as
// appendBlockRecord() writes one; which subblocks lie inside the level is not its matter.
bool takeBlockRecord(std::span<const std::byte>& records, int block_side, BlockRecord& record);
// Read one record; check nothing but take any bytes.
Subblock decodeRange(const std::byte* record, VoxelType type);
Subblock decodeApronRange(const std::byte* record, VoxelType type);  // without mask

// Which of the block's local subblocks have a voxel inside the level; `origin` in blocks.
SubblockSet insideMask(const VolumeInfo& info, glm::ivec3 level_dims, glm::ivec3 origin);

struct FileLayout {
  std::uint32_t header_bytes = 0;
  std::uint64_t file_bytes = 0;
  std::size_t channels = 1;
  std::vector<LevelEntry> entries;        // of values, the finest first, then of maxima
  std::vector<ChannelSections> sections;  // entry after entry, inside one channel after channel
  std::uint32_t group_records = 0;        // as the header has it
  std::vector<Section> indices;           // of each entry; no bytes: it has none; the checksum is in the section

  ChannelSections& of(std::size_t entry, std::size_t channel) { return sections[entry * channels + channel]; }
  const ChannelSections& of(std::size_t entry, std::size_t channel) const {
    return sections[entry * channels + channel];
  }
};
// Which entry is which: a level in one form.
struct EntryPlace {
  int level = 0;
  Form form = Form::values;
};
inline std::size_t entryIndex(const VolumeInfo& info, int level, Form form) {
  return static_cast<std::size_t>(level) + (form == Form::values ? 0 : info.levels.size() - kFirstMaximaLevel);
}
inline EntryPlace entryPlace(std::size_t index, std::size_t levels) {
  if (index < levels) return {.level = static_cast<int>(index), .form = Form::values};
  return {.level = static_cast<int>(index - levels) + kFirstMaximaLevel, .form = Form::maxima};
}
// The order of entries in the file.
std::vector<std::size_t> fileOrder(const VolumeInfo& info);

// The next section behind `end`, which it moves behind that.
Section placeSection(std::uint64_t& end, std::uint64_t bytes);

// Sizes that do not follow from the counts. Of each entry; of each entry and channel as in FileLayout.
struct FileSizes {
  std::vector<std::uint64_t> blocks;
  std::vector<std::uint64_t> voxels;
  std::size_t metadata = 0;
  std::uint32_t group_records = 0;  // kGroupRecords: levels that have more records have an index
};
// Lays the sections out: fills dims, counts, offsets and sizes of every level and channel from info.type, dims, sides,
// the number of channels and the counts in info.levels; checksums are 0. Needs sections that together stay below 2^63
// bytes.
FileLayout layOutFile(const VolumeInfo& info, const FileSizes& sizes);

}  // namespace blockwalk
