// SPDX-License-Identifier: Apache-2.0
#include "volume/volume.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "volume/error.h"

namespace blockwalk {
namespace {

// The low 21 bits of `value` moved to every third bit.
std::uint64_t spreadBits(std::uint64_t value) {
  value &= 0x1fffff;
  value = (value | value << 32) & 0x001f00000000ffff;
  value = (value | value << 16) & 0x001f0000ff0000ff;
  value = (value | value << 8) & 0x100f00f00f00f00f;
  value = (value | value << 4) & 0x10c30c30c30c30c3;
  value = (value | value << 2) & 0x1249249249249249;
  return value;
}

int gatherBits(std::uint64_t code) {
  int value = 0;
  for (int bit = 0; bit < 21; ++bit) value |= static_cast<int>(code >> (3 * bit) & 1) << bit;
  return value;
}

// Index of `code` in the ascending `codes`, looked for after `from`; codes.size() when it is not there. Neighbours are
// near in Morton order, so doubling steps find them in a few cache lines where a plain binary search would touch many.
std::size_t findAfter(const std::vector<std::uint64_t>& codes, std::size_t from, std::uint64_t code) {
  std::size_t lo = from + 1;
  std::size_t step = 1;
  while (lo + step < codes.size() && codes[lo + step] < code) {
    lo += step;
    step *= 2;
  }
  const std::size_t hi = std::min(lo + step + 1, codes.size());
  const auto begin = codes.begin() + static_cast<std::ptrdiff_t>(std::min(lo, codes.size()));
  const auto end = codes.begin() + static_cast<std::ptrdiff_t>(hi);
  const auto found = std::lower_bound(begin, end, code);
  return found != end && *found == code ? static_cast<std::size_t>(found - codes.begin()) : codes.size();
}

}  // namespace

std::uint64_t mortonCode(glm::uvec3 position) {
  return spreadBits(position.x) | spreadBits(position.y) << 1 | spreadBits(position.z) << 2;
}

glm::ivec3 mortonPosition(std::uint64_t code) {
  return {gatherBits(code), gatherBits(code >> 1), gatherBits(code >> 2)};
}

void linkNeighbours(std::vector<Block>& blocks) {
  BLOCKWALK_CHECK(blocks.size(), <, kNoBlock);
  std::vector<std::uint64_t> codes(blocks.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    codes[i] = mortonCode(glm::uvec3(blocks[i].origin));
    blocks[i].neighbours.fill(kNoBlock);
    if (i > 0) BLOCKWALK_CHECK(codes[i - 1], <, codes[i]);
  }
  // A neighbour on the positive side has the larger code; each find links both.
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      glm::uvec3 origin(blocks[i].origin);
      ++origin[axis];
      const std::size_t other = findAfter(codes, i, mortonCode(origin));
      if (other == codes.size()) continue;
      const auto face = static_cast<std::size_t>(2 * axis);
      blocks[i].neighbours[face + 1] = static_cast<std::uint32_t>(other);
      blocks[other].neighbours[face] = static_cast<std::uint32_t>(i);
    }
  }
}

glm::ivec3 levelDims(glm::ivec3 dims, int level) {
  BLOCKWALK_CHECK(level, >=, 0);
  BLOCKWALK_CHECK(level, <, kMaxLevels);
  const int half = (1 << level) - 1;
  return {(dims.x + half) >> level, (dims.y + half) >> level, (dims.z + half) >> level};
}

glm::ivec3 latticeDims(glm::ivec3 dims, int side) { return (dims + (side - 1)) / side; }

std::uint64_t cellCount(glm::ivec3 lattice_dims) {
  return static_cast<std::uint64_t>(lattice_dims.x) * static_cast<std::uint64_t>(lattice_dims.y) *
         static_cast<std::uint64_t>(lattice_dims.z);
}

int levelCount(glm::ivec3 dims, int block_voxels) {
  BLOCKWALK_CHECK(block_voxels, >, 1);
  int count = 1;
  for (int side = std::max({dims.x, dims.y, dims.z}); side > block_voxels; side = (side + 1) / 2) ++count;
  return count;
}

namespace {

std::array<glm::dvec3, 8> cornersOf(const VolumeInfo& info, const VoxelBox& box) {
  std::array<glm::dvec3, 8> corners;
  for (int i = 0; i < 8; ++i) {
    const glm::ivec3 corner = box.begin + box.dims() * glm::ivec3(i & 1, i >> 1 & 1, i >> 2);
    corners[static_cast<std::size_t>(i)] = glm::dvec3(info.world_from_index * glm::dvec4(corner, 1));
  }
  return corners;
}

}  // namespace

std::array<glm::dvec3, 8> worldCorners(const VolumeInfo& info) { return cornersOf(info, {.end = info.dims}); }

WorldBox worldBox(const VolumeInfo& info) { return worldBox(info, {.end = info.dims}); }

WorldBox worldBox(const VolumeInfo& info, const VoxelBox& voxels) {
  WorldBox box{.min = glm::dvec3(std::numeric_limits<double>::infinity()),
               .max = glm::dvec3(-std::numeric_limits<double>::infinity())};
  for (const glm::dvec3& corner : cornersOf(info, voxels)) {
    box.min = glm::min(box.min, corner);
    box.max = glm::max(box.max, corner);
  }
  return box;
}

VoxelBox nonemptyBox(const VolumeInfo& info) {
  return info.nonempty.isEmpty() ? VoxelBox{.end = info.dims} : info.nonempty;
}

double unitDistance(const VolumeInfo& info) {
  const glm::dmat4& map = info.world_from_index;
  return std::min({glm::length(glm::dvec3(map[0])), glm::length(glm::dvec3(map[1])), glm::length(glm::dvec3(map[2]))});
}

double highDensity(VoxelType type, const ChannelInfo& channel) {
  // Of all steps, where there are several: their number of voxels is that of the histogram.
  const std::uint64_t voxels = std::accumulate(channel.histogram.begin(), channel.histogram.end(), std::uint64_t{0});
  if (voxels == 0) return static_cast<double>(emptyValue(type, channel));
  const double lo = static_cast<double>(channel.histogram_lo);
  const double width = (static_cast<double>(channel.histogram_hi) - lo) / kHistogramBins;
  std::uint64_t below = 0;
  for (int bin = 0; bin < kHistogramBins; ++bin) {
    below += channel.histogram[static_cast<std::size_t>(bin)];
    if (static_cast<double>(below) < kHighShare * static_cast<double>(voxels)) continue;
    return std::min(lo + (bin + 1) * width, static_cast<double>(channel.density_max));
  }
  return static_cast<double>(channel.density_max);
}

float emptyValue(VoxelType type, const ChannelInfo& channel) {
  if (type == VoxelType::rgba8) return 0;
  const float greatest = type == VoxelType::u16 ? 65535.0f : 255.0f;
  const auto zero = static_cast<float>(channel.storedFromData(0)) + 0.0f;
  const float value = zero <= channel.empty_threshold ? zero : channel.empty_threshold;
  return type == VoxelType::f32 ? value : std::clamp(std::floor(value), 0.0f, greatest);
}

}  // namespace blockwalk
