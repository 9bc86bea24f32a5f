// SPDX-License-Identifier: Apache-2.0
#include "volume/file/apron.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstring>
#include <map>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kCacheBytes = std::uint64_t{256} << 20;

// Calls run(T{}) with the type that a voxel is stored as; rgba8 as one word.
template <typename Run>
void withVoxelType(VoxelType type, Run run) {
  switch (type) {
    case VoxelType::u8:
      return run(std::uint8_t{});
    case VoxelType::u16:
      return run(std::uint16_t{});
    case VoxelType::f32:
      return run(float{});
    case VoxelType::rgba8:
      return run(std::uint32_t{});
  }
}

template <typename T>
float densityOf(T voxel) {
  if constexpr (std::is_same_v<T, std::uint32_t>) {
    return static_cast<float>(voxel >> 24);
  } else {
    return static_cast<float>(voxel);
  }
}

// Which of the 26 neighbours of a subblock have one of its non-empty voxels in their ring. Bit dx + 3 dy + 9 dz, each d
// 0, 1 or 2 for -1, 0 and +1.
template <typename T>
std::bitset<27> ringReach(const std::byte* voxels, int side, float threshold) {
  std::bitset<27> reach;
  for (int z = 0; z < side; ++z) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x, voxels += sizeof(T)) {
        const bool inside = x > 0 && x < side - 1 && y > 0 && y < side - 1 && z > 0 && z < side - 1;
        if (inside) continue;
        T voxel{};
        std::memcpy(&voxel, voxels, sizeof voxel);
        if (isEmptyDensity(densityOf(voxel), threshold)) continue;
        const std::array<std::array<int, 2>, 3> ends{{{x == 0 ? 0 : 1, x == side - 1 ? 2 : 1},
                                                      {y == 0 ? 0 : 1, y == side - 1 ? 2 : 1},
                                                      {z == 0 ? 0 : 1, z == side - 1 ? 2 : 1}}};
        for (int dz = ends[2][0]; dz <= ends[2][1]; ++dz) {
          for (int dy = ends[1][0]; dy <= ends[1][1]; ++dy) {
            for (int dx = ends[0][0]; dx <= ends[0][1]; ++dx)
              reach.set(static_cast<std::size_t>(dx + 3 * (dy + 3 * dz)));
          }
        }
      }
    }
  }
  return reach;
}

// Sets empty voxels to the empty value.
template <typename T>
void settleEmpties(std::vector<std::byte>& voxels, VoxelType type, const ChannelInfo& channel) {
  const T empty = static_cast<T>(emptyValue(type, channel));
  for (std::size_t i = 0; i < voxels.size(); i += sizeof(T)) {
    T voxel{};
    std::memcpy(&voxel, voxels.data() + i, sizeof voxel);
    if (isEmptyDensity(densityOf(voxel), channel.empty_threshold)) std::memcpy(voxels.data() + i, &empty, sizeof empty);
  }
}

template <typename T>
void fillWith(std::vector<std::byte>& voxels, T value) {
  for (std::size_t i = 0; i < voxels.size(); i += sizeof(T)) std::memcpy(voxels.data() + i, &value, sizeof value);
}

template <typename Visit>
void forEachStored(const Block& block, int block_side, Visit visit) {
  for (int local = 0; local < block_side * block_side * block_side; ++local) {
    if ((block.occupancy[static_cast<std::size_t>(local) / 64] >> (local % 64) & 1u) == 0) continue;
    visit(glm::ivec3(local % block_side, local / block_side % block_side, local / (block_side * block_side)));
  }
}

}  // namespace

ApronLevel::ApronLevel(const VolumeFile& file, int level, int channel)
    : file_(file), level_(level), channel_(channel), source_(file.readLevel(level, channel)), dense_(denseBytes()) {
  for (std::size_t i = 0; i < source_.blocks.size(); ++i) {
    source_blocks_.emplace(mortonCode(glm::uvec3(source_.blocks[i].origin)), i);
  }
  findSubblocks();
}

ApronLevel::ApronLevel(const ApronLevel& found, int channel)
    : file_(found.file_),
      level_(found.level_),
      channel_(channel),
      source_(file_.readLevel(level_, channel)),
      source_blocks_(found.source_blocks_),
      records_(found.records_),
      dense_(denseBytes()) {
  // The ranges are another channel's.
  std::ranges::fill(records_.subblocks, Subblock{});
  for (Block& block : records_.blocks) {
    block.density_min = 0;
    block.density_max = 0;
    block.range_mask = 0;
  }
}

std::size_t ApronLevel::denseBytes() const {
  const auto side = static_cast<std::size_t>(file_.info().blockVoxels() + 2);
  return side * side * side * voxelBytes(file_.info().type);
}

std::uint64_t ApronLevel::subblockVoxels() const {
  const auto side = static_cast<std::uint64_t>(file_.info().subblock_side + 2);
  return side * side * side;
}

std::uint64_t ApronLevel::subblockBytes() const { return subblockVoxels() * voxelBytes(file_.info().type); }

void ApronLevel::findSubblocks() {
  const VolumeInfo& info = file_.info();
  const int side = info.subblock_side;
  const glm::ivec3 subblock_dims = (source_.info.dims + (side - 1)) / side;
  // Morton code of a block to what it holds; ordered as blocks must be.
  std::map<std::uint64_t, Block> found;
  const auto add = [&](glm::ivec3 subblock) {
    const glm::ivec3 origin = subblock / info.block_side;
    const glm::ivec3 at = subblock - origin * info.block_side;
    Block& block = found[mortonCode(glm::uvec3(origin))];
    block.origin = origin;
    const int local = at.x + info.block_side * (at.y + info.block_side * at.z);
    block.occupancy[static_cast<std::size_t>(local) / 64] |= std::uint64_t{1} << (local % 64);
  };
  const std::size_t subblock_bytes = info.subblockVoxels() * voxelBytes(info.type);
  for (std::size_t i = 0; i < source_.blocks.size(); ++i) {
    const Block& block = source_.blocks[i];
    // What any of the channels reaches; each is looked at alone, so that one is in memory at a time.
    std::vector<std::bitset<27>> reaches(block.subblock_count);
    for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
      const std::byte* voxels = stored(i, static_cast<int>(channel)).data();
      for (std::bitset<27>& reach : reaches) {
        withVoxelType(info.type, [&](auto voxel) {
          reach |= ringReach<decltype(voxel)>(voxels, side, info.channels[channel].empty_threshold);
        });
        voxels += subblock_bytes;
      }
    }
    auto next = reaches.begin();
    forEachStored(block, info.block_side, [&](glm::ivec3 local) {
      const glm::ivec3 subblock = block.origin * info.block_side + local;
      std::bitset<27> reach = *next++;
      reach.set(13);  // itself
      for (int d = 0; d < 27; ++d) {
        if (!reach.test(static_cast<std::size_t>(d))) continue;
        const glm::ivec3 other = subblock + glm::ivec3(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1);
        const bool within =
            glm::all(glm::greaterThanEqual(other, glm::ivec3(0))) && glm::all(glm::lessThan(other, subblock_dims));
        if (within) add(other);
      }
    });
  }
  std::uint64_t subblocks = 0;
  for (auto& [code, block] : found) {
    block.first_subblock = subblocks;
    int count = 0;
    for (const std::uint64_t word : block.occupancy) count += std::popcount(word);
    block.subblock_count = static_cast<std::uint16_t>(count);
    subblocks += block.subblock_count;
    records_.blocks.push_back(block);
  }
  linkNeighbours(records_.blocks);
  records_.subblocks.resize(subblocks);
  records_.info = source_.info;
  records_.info.block_count = records_.blocks.size();
  records_.info.subblock_count = subblocks;
  records_.info.voxel_bytes = subblocks * subblockBytes();
}

// The voxels of one channel of a block of the file, empties settled.
const std::vector<std::byte>& ApronLevel::stored(std::size_t block, int channel) {
  const VolumeInfo& info = file_.info();
  const std::size_t key = block * info.channels.size() + static_cast<std::size_t>(channel);
  const auto known = cache_.find(key);
  if (known != cache_.end()) {
    ages_.splice(ages_.begin(), ages_, known->second.age);
    return known->second.voxels;
  }
  const Block& record = source_.blocks[block];
  std::vector<std::byte> voxels(record.subblock_count * info.subblockVoxels() * voxelBytes(info.type));
  file_.readVoxels(level_, channel, record.first_subblock, record.subblock_count, voxels);
  const ChannelInfo& values = info.channels[static_cast<std::size_t>(channel)];
  withVoxelType(info.type, [&](auto voxel) { settleEmpties<decltype(voxel)>(voxels, info.type, values); });
  cached_bytes_ += voxels.size();
  while (cached_bytes_ > kCacheBytes && !ages_.empty()) {
    const auto oldest = cache_.find(ages_.back());
    cached_bytes_ -= oldest->second.voxels.size();
    cache_.erase(oldest);
    ages_.pop_back();
  }
  ages_.push_front(key);
  return cache_.emplace(key, CachedBlock{.voxels = std::move(voxels), .age = ages_.begin()}).first->second.voxels;
}

// Copies into dense_ what the block of the file around[...] says of the block at `origin` and its ring.
void ApronLevel::gather(glm::ivec3 origin, std::size_t source) {
  const VolumeInfo& info = file_.info();
  const int side = info.subblock_side;
  const int dense_side = info.blockVoxels() + 2;
  const std::size_t bytes = voxelBytes(info.type);
  const Block& block = source_.blocks[source];
  const std::byte* voxels = stored(source, channel_).data();
  const glm::ivec3 shift = (block.origin - origin) * info.blockVoxels() + 1;
  forEachStored(block, info.block_side, [&](glm::ivec3 local) {
    const glm::ivec3 corner = shift + local * side;
    const glm::ivec3 first = glm::max(corner, glm::ivec3(0));
    const glm::ivec3 end = glm::min(corner + side, glm::ivec3(dense_side));
    if (first.x < end.x) {
      for (int z = first.z; z < end.z; ++z) {
        for (int y = first.y; y < end.y; ++y) {
          const int from = first.x - corner.x + side * (y - corner.y + side * (z - corner.z));
          const std::size_t to = static_cast<std::size_t>(first.x + dense_side * (y + dense_side * z));
          std::memcpy(dense_.data() + to * bytes, voxels + static_cast<std::size_t>(from) * bytes,
                      static_cast<std::size_t>(end.x - first.x) * bytes);
        }
      }
    }
    voxels += info.subblockVoxels() * bytes;
  });
}

// Voxels of dense_ outside the level repeat the nearest inside. `first_voxel` is the one at index 0 of dense_.
void ApronLevel::repeatEdges(glm::ivec3 first_voxel) {
  const int side = file_.info().blockVoxels() + 2;
  const std::size_t bytes = voxelBytes(file_.info().type);
  const std::array<int, 3> strides{1, side, side * side};
  for (int axis = 0; axis < 3; ++axis) {
    const int inside_begin = std::max(0, -first_voxel[axis]);
    const int inside_end = std::min(side, source_.info.dims[axis] - first_voxel[axis]);
    if (inside_begin == 0 && inside_end == side) continue;
    const int u = strides[static_cast<std::size_t>((axis + 1) % 3)];
    const int v = strides[static_cast<std::size_t>((axis + 2) % 3)];
    const int along = strides[static_cast<std::size_t>(axis)];
    for (int row = 0; row < side * side; ++row) {
      std::byte* line = dense_.data() + static_cast<std::size_t>(row % side * u + row / side * v) * bytes;
      const auto at = [&](int i) { return line + static_cast<std::size_t>(i * along) * bytes; };
      for (int i = 0; i < inside_begin; ++i) std::memcpy(at(i), at(inside_begin), bytes);
      for (int i = inside_end; i < side; ++i) std::memcpy(at(i), at(inside_end - 1), bytes);
    }
  }
}

void ApronLevel::describeSubblock(const std::byte* voxels, Subblock& subblock) const {
  const ChannelInfo& channel = file_.info().channels[static_cast<std::size_t>(channel_)];
  const std::uint64_t count = subblockVoxels();
  withVoxelType(file_.info().type, [&](auto kind) {
    using T = decltype(kind);
    float least = std::numeric_limits<float>::infinity();
    float largest = -least;
    for (std::uint64_t i = 0; i < count; ++i) {
      T voxel{};
      std::memcpy(&voxel, voxels + i * sizeof(T), sizeof voxel);
      least = std::min(least, densityOf(voxel));
      largest = std::max(largest, densityOf(voxel));
    }
    subblock.density_min = least;
    subblock.density_max = largest;
  });
  subblock.range_mask = 0;
  if (subblock.density_max <= channel.empty_threshold) return;
  // Interpolation passes through every value between the two.
  for (int bin = rangeMaskBin(channel.bin_cuts, subblock.density_min);
       bin <= rangeMaskBin(channel.bin_cuts, subblock.density_max); ++bin) {
    subblock.range_mask |= static_cast<std::uint8_t>(1 << bin);
  }
}

void ApronLevel::readBlock(std::size_t index, std::span<std::byte> out) {
  const VolumeInfo& info = file_.info();
  Block& block = records_.blocks.at(index);
  BLOCKWALK_CHECK(out.size(), ==, block.subblock_count * subblockBytes());
  const float empty = emptyValue(info.type, info.channels[static_cast<std::size_t>(channel_)]);
  withVoxelType(info.type, [&](auto kind) { fillWith(dense_, static_cast<decltype(kind)>(empty)); });
  for (int d = 0; d < 27; ++d) {
    const glm::ivec3 around = block.origin + glm::ivec3(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1);
    if (glm::any(glm::lessThan(around, glm::ivec3(0)))) continue;
    const auto source = source_blocks_.find(mortonCode(glm::uvec3(around)));
    if (source != source_blocks_.end()) gather(block.origin, source->second);
  }
  repeatEdges(block.origin * info.blockVoxels() - 1);

  const int side = info.subblock_side + 2;
  const int dense_side = info.blockVoxels() + 2;
  const std::size_t bytes = voxelBytes(info.type);
  std::byte* to = out.data();
  std::size_t rank = block.first_subblock;
  block.density_min = std::numeric_limits<float>::infinity();
  block.density_max = -block.density_min;
  block.range_mask = 0;
  forEachStored(block, info.block_side, [&](glm::ivec3 local) {
    const std::byte* voxels = to;
    for (int z = 0; z < side; ++z) {
      for (int y = 0; y < side; ++y) {
        const glm::ivec3 from = local * info.subblock_side + glm::ivec3(0, y, z);
        const auto at = static_cast<std::size_t>(from.x + dense_side * (from.y + dense_side * from.z));
        std::memcpy(to, dense_.data() + at * bytes, static_cast<std::size_t>(side) * bytes);
        to += static_cast<std::size_t>(side) * bytes;
      }
    }
    Subblock& subblock = records_.subblocks[rank++];
    describeSubblock(voxels, subblock);
    block.density_min = std::min(block.density_min, subblock.density_min);
    block.density_max = std::max(block.density_max, subblock.density_max);
    block.range_mask |= subblock.range_mask;
  });
}

}  // namespace blockwalk
