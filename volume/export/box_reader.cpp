// SPDX-License-Identifier: Apache-2.0
#include "volume/export/box_reader.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "volume/error.h"
#include "volume/file/layout.h"

namespace blockwalk {
namespace {

template <typename T>
void fill(std::span<std::byte> out, float value) {
  const T one = static_cast<T>(value);
  for (std::size_t i = 0; i < out.size(); i += sizeof(T)) std::memcpy(&out[i], &one, sizeof(T));
}

void fillEmpty(VoxelType type, const ChannelInfo& channel, std::span<std::byte> out) {
  const float value = emptyValue(type, channel);
  switch (type) {
    case VoxelType::u8:
      return fill<std::uint8_t>(out, value);
    case VoxelType::u16:
      return fill<std::uint16_t>(out, value);
    case VoxelType::f32:
      return fill<float>(out, value);
    case VoxelType::rgba8:
      std::ranges::fill(out, std::byte{0});
  }
}

}  // namespace

std::shared_ptr<const StoredBlocks> readStoredBlocks(const VolumeFile& file, int level, Form form) {
  auto stored = std::make_shared<StoredBlocks>();
  stored->blocks = file.readLevel(level, 0, form).blocks;
  stored->codes.reserve(stored->blocks.size());
  for (const Block& block : stored->blocks) stored->codes.push_back(mortonCode(glm::uvec3(block.origin)));
  return stored;
}

BoxReader::BoxReader(const VolumeFile& file, int level, std::shared_ptr<const StoredBlocks> blocks, Form form)
    : file_(file),
      level_number_(level),
      form_(form),
      voxel_bytes_(voxelBytes(file.info().type)),
      stored_(blocks ? std::move(blocks) : readStoredBlocks(file, level, form)) {}

const Block* BoxReader::find(glm::ivec3 origin) const {
  const std::uint64_t code = mortonCode(glm::uvec3(origin));
  const auto found = std::ranges::lower_bound(stored_->codes, code);
  if (found == stored_->codes.end() || *found != code) return nullptr;
  return &stored_->blocks[static_cast<std::size_t>(found - stored_->codes.begin())];
}

bool BoxReader::isStored(const VoxelBox& box) const {
  const int side = file_.info().blockVoxels();
  const glm::ivec3 last = (box.end - 1) / side;
  for (int z = box.begin.z / side; z <= last.z; ++z) {
    for (int y = box.begin.y / side; y <= last.y; ++y) {
      for (int x = box.begin.x / side; x <= last.x; ++x) {
        if (find({x, y, z}) != nullptr) return true;
      }
    }
  }
  return false;
}

void BoxReader::read(int channel, const VoxelBox& box, std::span<std::byte> out) {
  const VolumeInfo& info = file_.info();
  BLOCKWALK_CHECK(out.size(), ==, box.voxels() * voxel_bytes_);
  fillEmpty(info.type, info.channels[static_cast<std::size_t>(channel)], out);
  const glm::ivec3 first = box.begin / info.blockVoxels();
  const glm::ivec3 last = (box.end - 1) / info.blockVoxels();
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        if (const Block* block = find({x, y, z})) copyBlock(channel, *block, box, out);
      }
    }
  }
}

void BoxReader::copyBlock(int channel, const Block& block, const VoxelBox& box, std::span<std::byte> out) {
  const VolumeInfo& info = file_.info();
  const int side = info.subblock_side;
  const int blocks = info.block_side;
  const std::size_t subblock_bytes = static_cast<std::size_t>(info.subblockVoxels()) * voxel_bytes_;
  block_.resize(block.subblock_count * subblock_bytes);
  file_.readVoxels(level_number_, channel, block.first_subblock, block.subblock_count, block_, form_);
  const glm::ivec3 dims = box.dims();
  const auto index = [](glm::ivec3 p, int width, int height) {
    return (static_cast<std::size_t>(p.z) * static_cast<std::size_t>(height) + static_cast<std::size_t>(p.y)) *
               static_cast<std::size_t>(width) +
           static_cast<std::size_t>(p.x);
  };
  const std::byte* subblock = block_.data();
  for (int local = 0; local < blocks * blocks * blocks; ++local) {
    if (!contains(block.occupancy, local)) continue;
    const glm::ivec3 place(local % blocks, local / blocks % blocks, local / (blocks * blocks));
    const glm::ivec3 origin = (block.origin * blocks + place) * side;
    const glm::ivec3 begin = glm::max(origin, box.begin);
    const glm::ivec3 end = glm::min(origin + side, box.end);
    const std::size_t bytes = static_cast<std::size_t>(std::max(end.x - begin.x, 0)) * voxel_bytes_;
    for (int z = begin.z; z < end.z && bytes > 0; ++z) {
      for (int y = begin.y; y < end.y; ++y) {
        const glm::ivec3 row(begin.x, y, z);
        std::memcpy(&out[index(row - box.begin, dims.x, dims.y) * voxel_bytes_],
                    subblock + index(row - origin, side, side) * voxel_bytes_, bytes);
      }
    }
    subblock += subblock_bytes;
  }
}

}  // namespace blockwalk
