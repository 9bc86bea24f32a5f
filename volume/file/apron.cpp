// SPDX-License-Identifier: Apache-2.0
#include "volume/file/apron.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

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

ApronLevel::ApronLevel(const VolumeFile& file, int level, int channel, Form form)
    : file_(file),
      level_(level),
      channel_(channel),
      form_(form),
      source_(file.readLevel(level, channel, form)),
      records_(file.readApronLevel(level, channel, form)),
      dense_(denseBytes()) {
  source_.subblocks = {};
  for (std::size_t i = 0; i < source_.blocks.size(); ++i) {
    source_blocks_.emplace(mortonCode(glm::uvec3(source_.blocks[i].origin)), i);
  }
  records_.info.voxel_bytes = records_.info.subblock_count * subblockBytes();
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

// The voxels of a block of the file, empties settled.
const std::vector<std::byte>& ApronLevel::stored(std::size_t block) {
  const VolumeInfo& info = file_.info();
  const auto known = cache_.find(block);
  if (known != cache_.end()) {
    ages_.splice(ages_.begin(), ages_, known->second.age);
    return known->second.voxels;
  }
  const Block& record = source_.blocks[block];
  std::vector<std::byte> voxels(record.subblock_count * info.subblockVoxels() * voxelBytes(info.type));
  file_.readVoxels(level_, channel_, record.first_subblock, record.subblock_count, voxels, form_);
  const ChannelInfo& values = info.channels[static_cast<std::size_t>(channel_)];
  withVoxelType(info.type, [&](auto voxel) { settleEmpties<decltype(voxel)>(voxels, info.type, values); });
  cached_bytes_ += voxels.size();
  while (cached_bytes_ > kCacheBytes && !ages_.empty()) {
    const auto oldest = cache_.find(ages_.back());
    cached_bytes_ -= oldest->second.voxels.size();
    cache_.erase(oldest);
    ages_.pop_back();
  }
  ages_.push_front(block);
  return cache_.emplace(block, CachedBlock{.voxels = std::move(voxels), .age = ages_.begin()}).first->second.voxels;
}

// Copies into dense_ what the block of the file around[...] says of the block at `origin` and its apron.
void ApronLevel::gather(glm::ivec3 origin, std::size_t source) {
  const VolumeInfo& info = file_.info();
  const int side = info.subblock_side;
  const int dense_side = info.blockVoxels() + 2;
  const std::size_t bytes = voxelBytes(info.type);
  const Block& block = source_.blocks[source];
  const glm::ivec3 shift = (block.origin - origin) * info.blockVoxels() + 1;
  bool touches = false;
  forEachStored(block, info.block_side, [&](glm::ivec3 local) {
    const glm::ivec3 corner = shift + local * side;
    touches = touches || (glm::all(glm::greaterThan(corner + side, glm::ivec3(0))) &&
                          glm::all(glm::lessThan(corner, glm::ivec3(dense_side))));
  });
  if (!touches) return;
  const std::byte* voxels = stored(source).data();
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

void ApronLevel::readBlock(std::size_t index, std::span<std::byte> out) {
  const VolumeInfo& info = file_.info();
  const Block& block = records_.blocks.at(index);
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
  forEachStored(block, info.block_side, [&](glm::ivec3 local) {
    for (int z = 0; z < side; ++z) {
      for (int y = 0; y < side; ++y) {
        const glm::ivec3 from = local * info.subblock_side + glm::ivec3(0, y, z);
        const auto at = static_cast<std::size_t>(from.x + dense_side * (from.y + dense_side * from.z));
        std::memcpy(to, dense_.data() + at * bytes, static_cast<std::size_t>(side) * bytes);
        to += static_cast<std::size_t>(side) * bytes;
      }
    }
  });
}

}  // namespace blockwalk
