// SPDX-License-Identifier: Apache-2.0
// The byte map of a .bwv file. Everything is little endian. docs/format.md says the same in prose.
// Version 1 holds one channel, version 2 holds 2 to 4. Version 1 is version 2 with one channel whose values stand in
// the header instead of a ChannelEntry.
//
//   FileHeader                     2288 bytes
//   LevelEntry x levels x channels 128 bytes each, level 0 first, inside a level channel 0 first
//   ChannelEntry x channels        version 2: 2208 bytes each
//   source name                    FileHeader::source_name_bytes of UTF-8
//   for each level, coarsest first, level 0 last, for each channel, each section at the next multiple of 64, zeros
//   between:
//     block records                block_count x blockRecordBytes, in Morton order of origin
//     subblock records             subblock_count x subblockRecordBytes, block after block, in local raster order
//     chunk checksums              u64 x ceil(voxel bytes / 1 MiB): XXH3-64 of each MiB of the voxel section
//     voxels                       subblock_count x side^3 x voxelBytes, x fastest; beyond the level's dims: zeros
//   end of file: nothing follows the voxels of the last channel of level 0
//
//   block record     u16 origin[3] in blocks | u8 range mask | u8 subblock count | D density min | D density max |
//                    occupancy, ceil(block_side^3 / 8) bytes: bit i of byte i/8 is local subblock i
//   subblock record  D density min | D density max | u8 range mask
//                    version 2, where the channel has no non-empty voxel: 0, 0, 0
//   D is the density as it is stored: u8 for rgba8 and u8, u16 for u16, f32 for f32.
//
// Neighbours and first_subblock are not stored: they follow from the order.
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
constexpr std::uint32_t kFileVersion = 1;
constexpr std::uint32_t kFileVersionOfChannels = 2;
constexpr std::uint64_t kSectionAlignment = 64;
constexpr std::uint64_t kChunkBytes = std::uint64_t{1} << 20;
constexpr std::uint32_t kMaxSourceNameBytes = 1024;
constexpr std::uint32_t kMaxChannelNameBytes = 64;

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
  std::uint32_t header_bytes = 0;  // FileHeader, level and channel entries, source name
  std::uint64_t file_bytes = 0;
  std::uint64_t header_checksum = 0;  // XXH3-64 of the header_bytes with this field zero
  std::uint8_t type = 0;              // VoxelType
  std::uint8_t subblock_side = 0;
  std::uint8_t block_side = 0;
  std::uint8_t level_count = 0;
  std::array<std::uint32_t, 3> dims{};
  std::array<double, 12> world_from_index{};  // the first three rows, row after row; the fourth is 0 0 0 1
  ChannelFields channel;                      // version 1; version 2: all bytes 0
  std::uint32_t source_name_bytes = 0;
  std::uint32_t channel_count = 0;  // version 1: 0; version 2: 2..4
};
static_assert(sizeof(FileHeader) == 2288 && offsetof(FileHeader, dims) == 36 &&
              offsetof(FileHeader, world_from_index) == 48 && offsetof(FileHeader, channel) == 144 &&
              offsetof(FileHeader, source_name_bytes) == 2280);

struct ChannelEntry {
  ChannelFields fields;
  std::uint32_t name_bytes = 0;
  std::uint32_t reserved = 0;                     // 0
  std::array<char, kMaxChannelNameBytes> name{};  // UTF-8, zeros behind
};
static_assert(sizeof(ChannelEntry) == 2208);

struct Section {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::uint64_t checksum = 0;  // XXH3-64; of voxels 0, their chunks have their own
};

struct LevelEntry {
  std::array<std::uint32_t, 3> dims{};
  std::uint32_t reserved = 0;  // 0
  std::uint64_t block_count = 0;
  std::uint64_t subblock_count = 0;
  Section blocks;
  Section subblocks;
  Section chunk_checksums;
  Section voxels;
};
static_assert(sizeof(LevelEntry) == 128 && sizeof(Section) == 24);

constexpr std::size_t kMaxHeaderBytes =
    sizeof(FileHeader) + kMaxChannels * (kMaxLevels * sizeof(LevelEntry) + sizeof(ChannelEntry)) + kMaxSourceNameBytes;

// Bytes of one stored density.
std::size_t densityBytes(VoxelType type);
// Bytes of one block record and of one subblock record.
std::size_t blockRecordBytes(VoxelType type, int block_side);
std::size_t subblockRecordBytes(VoxelType type);

// Appends one record. The densities are exact in the stored width.
void appendBlockRecord(std::vector<std::byte>& out, const VolumeInfo& info, const Block& block);
void appendSubblockRecord(std::vector<std::byte>& out, const VolumeInfo& info, const Subblock& subblock);
// Reads one record; checks nothing but takes any bytes. first_subblock and neighbours stay as they are by default.
Block decodeBlockRecord(const std::byte* record, const VolumeInfo& info);
Subblock decodeSubblockRecord(const std::byte* record, const VolumeInfo& info);

// Which of the block's local subblocks have a voxel inside the level; `origin` in blocks.
std::array<std::uint64_t, 4> insideMask(const VolumeInfo& info, glm::ivec3 level_dims, glm::ivec3 origin);

struct FileLayout {
  std::uint32_t header_bytes = 0;
  std::uint64_t file_bytes = 0;
  std::size_t channels = 1;
  std::vector<LevelEntry> entries;  // level after level, the finest first, inside a level channel after channel

  std::size_t levelCount() const { return entries.size() / channels; }
  LevelEntry& entry(std::size_t level, std::size_t channel) { return entries[level * channels + channel]; }
  const LevelEntry& entry(std::size_t level, std::size_t channel) const { return entries[level * channels + channel]; }
};
// Lays the sections out: fills dims, counts, offsets and sizes of every level and channel from info.type, dims, sides,
// the number of channels and the counts in info.levels; checksums are 0. Needs counts whose sections together stay
// below 2^63 bytes.
FileLayout layOutFile(const VolumeInfo& info);

}  // namespace blockwalk
