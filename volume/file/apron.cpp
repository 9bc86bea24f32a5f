// SPDX-License-Identifier: Apache-2.0
#include "volume/file/apron.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "volume/error.h"
#include "volume/file/layout.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kBlocksAround = 27;

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
  if constexpr (!std::is_same_v<T, std::uint32_t>) {
    if (std::is_integral_v<T> && empty == 0 && channel.empty_threshold < 1) return;  // they have it
  }
  for (std::size_t i = 0; i < voxels.size(); i += sizeof(T)) {
    T voxel{};
    std::memcpy(&voxel, voxels.data() + i, sizeof voxel);
    voxel = isEmptyDensity(densityOf(voxel), channel.empty_threshold) ? empty : voxel;
    std::memcpy(voxels.data() + i, &voxel, sizeof voxel);
  }
}

template <typename Visit>
void forEachIn(const SubblockSet& set, int block_side, Visit visit) {
  for (int local = 0; local < block_side * block_side * block_side; ++local) {
    if (!contains(set, local)) continue;
    visit(glm::ivec3(local % block_side, local / block_side % block_side, local / (block_side * block_side)));
  }
}

std::uint64_t codeOf(const Block& block) { return mortonCode(glm::uvec3(block.origin)); }

// Takes the blocks out that are not inside.
std::vector<Block> cropTo(const BlockWindow& window, Level& level) {
  std::vector<Block> outside;
  std::size_t kept = 0;
  std::size_t kept_subblocks = 0;
  for (const Block& block : level.blocks) {
    if (!window.contains(block.origin)) {
      outside.push_back(block);
      continue;
    }
    const auto from = level.subblocks.begin() + static_cast<std::ptrdiff_t>(block.first_subblock);
    std::copy(from, from + block.subblock_count, level.subblocks.begin() + static_cast<std::ptrdiff_t>(kept_subblocks));
    Block& inside = level.blocks[kept++] = block;
    inside.first_subblock = kept_subblocks;
    kept_subblocks += block.subblock_count;
  }
  if (outside.empty()) return outside;
  level.blocks.resize(kept);
  level.subblocks.resize(kept_subblocks);
  level.blocks.shrink_to_fit();
  level.subblocks.shrink_to_fit();
  level.info.block_count = kept;
  level.info.subblock_count = kept_subblocks;
  linkNeighbours(level.blocks);
  return outside;
}

}  // namespace

ApronLevel::ApronLevel(const VolumeFile& file, int level, int channel, Form form, std::uint64_t cache_bytes,
                       const BlockWindow& window, std::shared_ptr<Structure> structure)
    : file_(file),
      level_(level),
      channel_(channel),
      form_(form),
      window_(window),
      structure_(std::move(structure)),
      cache_bytes_(cache_bytes) {
  const auto side = static_cast<std::uint64_t>(file_.info().blockVoxels());
  cache_bytes_ = std::max(cache_bytes_, kBlocksAround * side * side * side * voxelBytes(file_.info().type));
}

ApronLevel::ApronLevel(const VolumeFile& file, int level, int channel, Form form, std::uint64_t cache_bytes,
                       const BlockWindow& window)
    : ApronLevel(file, level, channel, form, cache_bytes, window, readStructure(file, level, channel, form, window)) {}

std::unique_ptr<ApronLevel> ApronLevel::another(std::uint64_t cache_bytes) const {
  return std::unique_ptr<ApronLevel>(new ApronLevel(file_, level_, channel_, form_, cache_bytes, window_, structure_));
}

std::shared_ptr<ApronLevel::Structure> ApronLevel::readStructure(const VolumeFile& file, int level, int channel,
                                                                 Form form, const BlockWindow& window) {
  auto made = std::make_shared<Structure>();
  made->records = file.readApronLevel(level, channel, form, window.grown());
  made->around = cropTo(window, made->records);
  const auto side = static_cast<std::uint64_t>(file.info().subblock_side + 2);
  made->records.info.voxel_bytes =
      made->records.info.subblock_count * side * side * side * voxelBytes(file.info().type);
  return made;
}

std::uint64_t ApronLevel::subblockVoxels() const {
  const auto side = static_cast<std::uint64_t>(file_.info().subblock_side + 2);
  return side * side * side;
}

std::uint64_t ApronLevel::subblockBytes() const { return subblockVoxels() * voxelBytes(file_.info().type); }

// Null where there is none.
const Block* ApronLevel::find(glm::ivec3 origin) const {
  const std::vector<Block>& blocks = window_.contains(origin) ? structure_->records.blocks : structure_->around;
  const std::uint64_t code = mortonCode(glm::uvec3(origin));
  const auto found = std::ranges::lower_bound(blocks, code, {}, codeOf);
  return found != blocks.end() && codeOf(*found) == code ? &*found : nullptr;
}

void ApronLevel::dropCache() {
  cache_.clear();
  ages_.clear();
  cached_bytes_ = 0;
}

// The voxels of a block of the file, empties settled.
const std::vector<std::byte>& ApronLevel::stored(const Block& block) {
  const VolumeInfo& info = file_.info();
  const auto known = cache_.find(block.first_stored);
  if (known != cache_.end()) {
    ages_.splice(ages_.begin(), ages_, known->second.age);
    return known->second.voxels;
  }
  const auto count = static_cast<std::uint64_t>(countOf(block.stored));
  std::vector<std::byte> voxels(count * info.subblockVoxels() * voxelBytes(info.type));
  file_.readVoxels(level_, channel_, block.first_stored, count, voxels, form_);
  const ChannelInfo& values = info.channels[static_cast<std::size_t>(channel_)];
  withVoxelType(info.type, [&](auto voxel) { settleEmpties<decltype(voxel)>(voxels, info.type, values); });
  cached_bytes_ += voxels.size();
  while (cached_bytes_ > cache_bytes_ && !ages_.empty()) {
    const auto oldest = cache_.find(ages_.back());
    cached_bytes_ -= oldest->second.voxels.size();
    cache_.erase(oldest);
    ages_.pop_back();
  }
  ages_.push_front(block.first_stored);
  return cache_.emplace(block.first_stored, CachedBlock{.voxels = std::move(voxels), .age = ages_.begin()})
      .first->second.voxels;
}

// Fills sources_ for a block. The cache holds the blocks around it together: at least 27.
void ApronLevel::findSources(glm::ivec3 origin) {
  const VolumeInfo& info = file_.info();
  const int side = info.block_side + 2;
  sources_.assign(static_cast<std::size_t>(side * side * side), nullptr);
  for (int d = 0; d < 27; ++d) {
    const glm::ivec3 around = origin + glm::ivec3(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1);
    if (glm::any(glm::lessThan(around, glm::ivec3(0)))) continue;
    const Block* const block = find(around);
    if (block == nullptr) continue;
    const glm::ivec3 shift = (around - origin) * info.block_side + 1;
    const std::byte* voxels = nullptr;  // read where one of its subblocks is needed
    std::size_t offset = 0;
    forEachIn(block->stored, info.block_side, [&](glm::ivec3 local) {
      const glm::ivec3 place = shift + local;
      if (glm::all(glm::greaterThanEqual(place, glm::ivec3(0))) && glm::all(glm::lessThan(place, glm::ivec3(side)))) {
        if (voxels == nullptr) voxels = stored(*block).data();
        sources_[static_cast<std::size_t>(place.x + side * (place.y + side * place.z))] = voxels + offset;
      }
      offset += info.subblockVoxels() * voxelBytes(info.type);
    });
  }
}

namespace {

// The voxels around one subblock: 3x3x3 of them in a table of rows `stride` long, its first at `corner`.
template <typename T, int side>
void writeSubblock(const std::byte* const* corner, int stride, T empty, std::byte* out) {
  constexpr std::size_t kRow = (side + 2) * sizeof(T);
  for (int z = -1; z <= side; ++z) {
    for (int y = -1; y <= side; ++y, out += kRow) {
      const std::byte* const* row = corner + stride * ((y + side) / side + stride * ((z + side) / side));
      const std::size_t first = static_cast<std::size_t>(side * ((y + side) % side + side * ((z + side) % side)));
      std::array<T, side + 2> line;
      line.fill(empty);
      if (row[0] != nullptr) std::memcpy(&line[0], row[0] + (first + side - 1) * sizeof(T), sizeof(T));
      if (row[1] != nullptr) std::memcpy(&line[1], row[1] + first * sizeof(T), side * sizeof(T));
      if (row[2] != nullptr) std::memcpy(&line[side + 1], row[2] + first * sizeof(T), sizeof(T));
      std::memcpy(out, line.data(), kRow);
    }
  }
}

template <typename T>
void writeSubblockOf(int side, const std::byte* const* corner, int stride, T empty, std::byte* out) {
  switch (side) {
    case 4:
      return writeSubblock<T, 4>(corner, stride, empty, out);
    case 8:
      return writeSubblock<T, 8>(corner, stride, empty, out);
    default:
      BLOCKWALK_CHECK(side, ==, 16);
      return writeSubblock<T, 16>(corner, stride, empty, out);
  }
}

// Voxels outside the level repeat the nearest inside. The subblock's first, one before its own, is at `first`.
void repeatEdges(glm::ivec3 first, glm::ivec3 dims, int side, std::size_t bytes, std::byte* voxels) {
  const std::array<int, 3> strides{1, side, side * side};
  for (int axis = 0; axis < 3; ++axis) {
    const int inside_begin = std::max(0, -first[axis]);
    const int inside_end = std::min(side, dims[axis] - first[axis]);
    if (inside_begin == 0 && inside_end == side) continue;
    const int u = strides[static_cast<std::size_t>((axis + 1) % 3)];
    const int v = strides[static_cast<std::size_t>((axis + 2) % 3)];
    const int along = strides[static_cast<std::size_t>(axis)];
    for (int row = 0; row < side * side; ++row) {
      std::byte* line = voxels + static_cast<std::size_t>(row % side * u + row / side * v) * bytes;
      const auto at = [&](int i) { return line + static_cast<std::size_t>(i * along) * bytes; };
      for (int i = 0; i < inside_begin; ++i) std::memcpy(at(i), at(inside_begin), bytes);
      for (int i = inside_end; i < side; ++i) std::memcpy(at(i), at(inside_end - 1), bytes);
    }
  }
}

}  // namespace

void ApronLevel::readBlock(std::size_t index, std::span<std::byte> out) {
  const VolumeInfo& info = file_.info();
  const Block& block = structure_->records.blocks.at(index);
  BLOCKWALK_CHECK(out.size(), ==, block.subblock_count * subblockBytes());
  findSources(block.origin);
  const int stride = info.block_side + 2;
  const std::size_t bytes = voxelBytes(info.type);
  const float empty = emptyValue(info.type, info.channels[static_cast<std::size_t>(channel_)]);
  std::byte* to = out.data();
  forEachIn(block.occupancy, info.block_side, [&](glm::ivec3 local) {
    const std::byte* const* corner =
        &sources_[static_cast<std::size_t>(local.x + stride * (local.y + stride * local.z))];
    withVoxelType(info.type, [&](auto kind) {
      writeSubblockOf(info.subblock_side, corner, stride, static_cast<decltype(kind)>(empty), to);
    });
    const glm::ivec3 first = block.origin * info.blockVoxels() + local * info.subblock_side - 1;
    repeatEdges(first, structure_->records.info.dims, info.subblock_side + 2, bytes, to);
    to += subblockBytes();
  });
}

}  // namespace blockwalk
