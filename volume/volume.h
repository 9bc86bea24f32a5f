// SPDX-License-Identifier: Apache-2.0
// The sparse volume as plain data: what a volume is (VolumeInfo) and the records of one level (Level).
//
// Index space of level n: voxel (i,j,k) covers [i,i+1)x[j,j+1)x[k,k+1), centre at +0.5. Level 0 is the finest; a voxel
// of level n+1 covers 2x2x2 voxels of level n. `world_from_index` takes level 0's index space to world space. "Stored
// units" are the numbers in the voxels; data units = value_offset + value_scale * stored, a map of each channel's own.
//
// A volume has 1..kMaxChannels channels: scalar fields of one type on one grid, each with its own values and its own
// idea of what is empty. They share the structure: a subblock is stored in all of them or in none.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "volume/voxel.h"
#include "volume/voxel_box.h"

namespace blockwalk {

constexpr int kMaxDim = 65536;     // voxels an axis
constexpr int kMaxLevels = 18;     // 65536 voxels halved until one voxel is left, and level 0
constexpr int kMaxBlockSide = 6;   // subblocks; 6^3 = 216 indices fit 8 bits
constexpr int kRangeMaskBins = 8;  // Vulkan instance masks have 8 bits (Derin et al. 2021, 2.3)
constexpr int kHistogramBins = 256;
constexpr int kMaxChannels = 4;
constexpr int kMaxSteps = 16384;             // in time, of a file
constexpr std::size_t kMaxNameBytes = 1024;  // of the source, of a label, of what else is for people
constexpr std::size_t kMaxChannelNameBytes = 64;

// What the voxels of a coarser level are made of: means or most frequent labels, or the greatest density, which is
// what a maximum along rays is drawn from. Level 0 and level 1 have values alone.
enum class Form : std::uint8_t { values = 0, maxima = 1 };
constexpr int kFirstMaximaLevel = 2;

// Size of one level, known without reading its records.
struct LevelInfo {
  glm::ivec3 dims{0};  // voxels: ceil(level 0 dims / 2^n)
  std::uint64_t block_count = 0;
  std::uint64_t subblock_count = 0;
  std::uint64_t voxel_bytes = 0;  // of one channel, unpacked: subblock_count * subblock_side^3 * voxelBytes
  // With those that have no voxels and whose apron has non-empty ones.
  std::uint64_t apron_block_count = 0;
  std::uint64_t apron_subblock_count = 0;
};

// What the values of a channel are: amounts, which have a mean, or names, which have not.
enum class ChannelValues : std::uint8_t { intensity = 0, labels = 1 };

// How the voxels of a block are packed in the file; one that would not get shorter is raw whatever was asked for.
enum class Codec : std::uint8_t { raw = 0, lz4 = 1, zstd = 2 };
constexpr std::size_t kCodecs = 3;
constexpr std::uint64_t kMostCountedPages = std::uint64_t{1} << 20;  // when a file is opened

using Color = std::array<std::uint8_t, 3>;

// One value of a channel of labels, in data units.
struct LabelInfo {
  double value = 0;
  std::string name = {};  // may be empty
  std::optional<Color> color = std::nullopt;
};

// The values of one channel. All text is for people: UTF-8 without control characters; empty where it is not known.
struct ChannelInfo {
  std::string name = {};  // at most kMaxChannelNameBytes
  std::string unit = {};  // of data values: "HU", "mm"
  std::optional<Color> color = std::nullopt;
  std::optional<std::array<double, 2>> window = std::nullopt;  // what to show first: least and greatest, data units
  ChannelValues values = ChannelValues::intensity;
  std::vector<LabelInfo> labels = {};  // ascending
  double value_scale = 1;              // above 0
  double value_offset = 0;
  // Stored units. A voxel whose density is <= empty_threshold, NaN or infinite is empty: it is never shown.
  float empty_threshold = 0;
  // Smallest and largest density of non-empty voxels of level 0, stored units; 0 and 0 when all are empty.
  float density_min = 0;
  float density_max = 0;
  // Interior cuts of the 8 range-mask bins, ascending, stored units: density d is in bin #{cuts <= d}.
  std::array<float, kRangeMaskBins - 1> bin_cuts{};
  // Non-empty voxels of level 0 in equal bins over [histogram_lo, histogram_hi] (stored units, both inclusive).
  float histogram_lo = 0;
  float histogram_hi = 0;
  std::array<std::uint64_t, kHistogramBins> histogram{};
  std::uint64_t nonempty_voxels = 0;   // level 0
  std::uint64_t nonfinite_voxels = 0;  // NaN or infinite in the source
  double largest_rounding = 0;         // data units: what conversion to the stored type changed at most

  double dataFromStored(double stored) const { return value_offset + value_scale * stored; }
  double storedFromData(double data) const { return (data - value_offset) / value_scale; }
};

// What people want to know of a volume and no picture depends on. Text as in ChannelInfo.
struct Metadata {
  std::string source_name;  // what it was imported from, no path
  std::string source_kind;  // "nrrd", "demo"
  std::string length_unit;  // of world space: "mm", "um"
  std::string space;        // what the axes of world space are: "left-posterior-superior"
  // What a later program wrote, by key: kept as it is.
  std::vector<std::pair<std::string, std::string>> others;
};

// The grid, and what its channels hold.
struct VolumeInfo {
  VoxelType type = VoxelType::u8;  // of every channel; rgba8 is a single channel
  glm::ivec3 dims{0};
  int subblock_side = 8;  // voxels: 4, 8 or 16
  int block_side = 6;     // subblocks: 1..6
  glm::dmat4 world_from_index{1.0};
  Metadata metadata;
  std::vector<LevelInfo> levels;                                    // [0] is the finest
  std::vector<LevelInfo> maxima;                                    // [0] is level kFirstMaximaLevel; or none
  std::vector<ChannelInfo> channels = std::vector<ChannelInfo>(1);  // 1..kMaxChannels
  int steps = 1;  // in time, of the file; all on this grid. Densities and histograms of the channels are of all of them
  // By Codec: of all levels, forms and channels, a block each. All 0 where they are more than kMostCountedPages.
  std::array<std::uint64_t, kCodecs> pages{};
  // Voxels of level 0, of all steps: the non-empty ones lie inside (volume/file/nonempty_box.h). Empty where there are
  // none; see nonemptyBox().
  VoxelBox nonempty{};

  // The level must have that form.
  const LevelInfo& level(int number, Form form) const {
    return form == Form::values ? levels.at(static_cast<std::size_t>(number))
                                : maxima.at(static_cast<std::size_t>(number - kFirstMaximaLevel));
  }
  bool has(int number, Form form) const {
    if (number < 0 || number >= static_cast<int>(levels.size())) return false;
    return form == Form::values || (number >= kFirstMaximaLevel && !maxima.empty());
  }
  int blockVoxels() const { return subblock_side * block_side; }
  std::uint64_t subblockVoxels() const {
    return static_cast<std::uint64_t>(subblock_side) * static_cast<std::uint64_t>(subblock_side * subblock_side);
  }
};

// bin of a density, 0..7, in stored units
inline int rangeMaskBin(const std::array<float, kRangeMaskBins - 1>& cuts, float density) {
  int bin = 0;
  for (float cut : cuts) bin += density >= cut ? 1 : 0;
  return bin;
}

// One stored subblock. Minimum, maximum and mask are over its non-empty voxels, in stored units.
struct Subblock {
  float density_min = 0;
  float density_max = 0;
  std::uint8_t range_mask = 0;  // bit b: some voxel lies in bin b; 0 where the channel is empty
};

constexpr std::uint32_t kNoBlock = 0xffffffffu;

// One block: up to block_side^3 subblocks, at least one. Blocks of a level are in Morton order of `origin`.
struct Block {
  glm::ivec3 origin{0};  // in blocks: the block's first voxel is origin * blockVoxels()
  float density_min = 0;
  float density_max = 0;
  std::uint8_t range_mask = 0;
  std::uint16_t subblock_count = 0;
  std::uint64_t first_subblock = 0;  // in Level::subblocks; the block's subblocks are consecutive
  // Bit i: local subblock i = x + block_side * (y + block_side * z) is stored. Stored ones keep that order.
  std::array<std::uint64_t, 4> occupancy{};
  // The same of those that have voxels in the file, of which the first is this to VolumeFile::readVoxels().
  std::array<std::uint64_t, 4> stored{};
  std::uint64_t first_stored = 0;
  // -x +x -y +y -z +z: index in Level::blocks, or kNoBlock
  std::array<std::uint32_t, 6> neighbours{kNoBlock, kNoBlock, kNoBlock, kNoBlock, kNoBlock, kNoBlock};
};

// Blocks of a level whose origins lie in [begin, end), in blocks; all of them unless it is said.
struct BlockWindow {
  glm::ivec3 begin{0};
  glm::ivec3 end{std::numeric_limits<int>::max()};

  bool contains(glm::ivec3 origin) const {
    return glm::all(glm::greaterThanEqual(origin, begin)) && glm::all(glm::lessThan(origin, end));
  }
  // Whether that is all of a lattice.
  bool holds(glm::ivec3 lattice_dims) const {
    return glm::all(glm::lessThanEqual(begin, glm::ivec3(0))) && glm::all(glm::greaterThanEqual(end, lattice_dims));
  }
  // With the blocks that touch those inside.
  BlockWindow grown() const {
    return {.begin = begin - 1, .end = glm::min(end, glm::ivec3(std::numeric_limits<int>::max() - 1)) + 1};
  }
  bool operator==(const BlockWindow&) const = default;
};

// The records of one level, or of those of its blocks that lie in a window, without its voxels.
struct Level {
  LevelInfo info;
  std::vector<Block> blocks;
  std::vector<Subblock> subblocks;
};

// Bits of x, y and z interleaved, x lowest; each below 2^21.
std::uint64_t mortonCode(glm::uvec3 position);
glm::ivec3 mortonPosition(std::uint64_t code);

// Fills Block::neighbours. The blocks must be in Morton order without repeats.
void linkNeighbours(std::vector<Block>& blocks);

// Of a lattice of cubes of `side` voxels over a box of `dims` voxels: its cells along each axis, and in all.
glm::ivec3 latticeDims(glm::ivec3 dims, int side);
std::uint64_t cellCount(glm::ivec3 lattice_dims);

// dims of level n; number of levels until one block holds the whole volume.
glm::ivec3 levelDims(glm::ivec3 dims, int level);
int levelCount(glm::ivec3 dims, int block_voxels);

// World box of the volume and its smallest voxel spacing, which is the unit distance of extinction and opacity.
struct WorldBox {
  glm::dvec3 min{0};
  glm::dvec3 max{0};
};
WorldBox worldBox(const VolumeInfo& info);
WorldBox worldBox(const VolumeInfo& info, const VoxelBox& box);
// What is to be in a picture of the volume where nobody says otherwise: where it holds something; where it holds
// nothing, all of it.
VoxelBox nonemptyBox(const VolumeInfo& info);
// World corners of the volume, which need not be those of its box; x changes first.
std::array<glm::dvec3, 8> worldCorners(const VolumeInfo& info);
double unitDistance(const VolumeInfo& info);

// Stored units: what at least kHighShare of the non-empty voxels of level 0 are at most, to the width of a bin of the
// histogram; the empty value where there are none. Unlike the largest density, a few hot voxels have no say in it.
constexpr double kHighShare = 0.998;
double highDensity(VoxelType type, const ChannelInfo& channel);

// What an empty voxel of a channel counts as in averages and interpolation, stored units, a value of the stored type:
// data value 0 where that is empty, else the threshold; 0 for rgba8.
float emptyValue(VoxelType type, const ChannelInfo& channel);

}  // namespace blockwalk
