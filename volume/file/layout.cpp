// SPDX-License-Identifier: Apache-2.0
#include "volume/file/layout.h"

#include <algorithm>
#include <cstring>

#include "volume/error.h"

namespace blockwalk {
namespace {

template <typename T>
void append(std::vector<std::byte>& out, const T& value) {
  const auto* bytes = reinterpret_cast<const std::byte*>(&value);
  out.insert(out.end(), bytes, bytes + sizeof value);
}

template <typename T>
T take(const std::byte*& at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  at += sizeof value;
  return value;
}

void appendDensity(std::vector<std::byte>& out, VoxelType type, float density) {
  switch (densityBytes(type)) {
    case 1:
      append(out, static_cast<std::uint8_t>(density));
      break;
    case 2:
      append(out, static_cast<std::uint16_t>(density));
      break;
    default:
      append(out, density);
  }
}

float takeDensity(const std::byte*& at, VoxelType type) {
  switch (densityBytes(type)) {
    case 1:
      return static_cast<float>(take<std::uint8_t>(at));
    case 2:
      return static_cast<float>(take<std::uint16_t>(at));
    default:
      return take<float>(at);
  }
}

std::size_t occupancyBytes(int block_side) {
  return (static_cast<std::size_t>(block_side * block_side * block_side) + 7) / 8;
}

Section placeSection(std::uint64_t& end, std::uint64_t bytes) {
  const std::uint64_t offset = (end + kSectionAlignment - 1) / kSectionAlignment * kSectionAlignment;
  end = offset + bytes;
  return {.offset = offset, .bytes = bytes, .checksum = 0};
}

}  // namespace

std::size_t densityBytes(VoxelType type) { return type == VoxelType::rgba8 ? 1 : voxelBytes(type); }

std::size_t blockRecordBytes(VoxelType type, int block_side) {
  return 3 * 2 + 1 + 1 + 2 * densityBytes(type) + occupancyBytes(block_side);
}

std::size_t subblockRecordBytes(VoxelType type) { return 2 * densityBytes(type) + 1; }

void appendBlockRecord(std::vector<std::byte>& out, const VolumeInfo& info, const Block& block) {
  for (int axis = 0; axis < 3; ++axis) append(out, static_cast<std::uint16_t>(block.origin[axis]));
  append(out, block.range_mask);
  append(out, static_cast<std::uint8_t>(block.subblock_count));
  appendDensity(out, info.type, block.density_min);
  appendDensity(out, info.type, block.density_max);
  const auto* occupancy = reinterpret_cast<const std::byte*>(block.occupancy.data());
  out.insert(out.end(), occupancy, occupancy + occupancyBytes(info.block_side));
}

void appendSubblockRecord(std::vector<std::byte>& out, const VolumeInfo& info, const Subblock& subblock) {
  appendDensity(out, info.type, subblock.density_min);
  appendDensity(out, info.type, subblock.density_max);
  append(out, subblock.range_mask);
}

Block decodeBlockRecord(const std::byte* record, const VolumeInfo& info) {
  Block block;
  for (int axis = 0; axis < 3; ++axis) block.origin[axis] = take<std::uint16_t>(record);
  block.range_mask = take<std::uint8_t>(record);
  block.subblock_count = take<std::uint8_t>(record);
  block.density_min = takeDensity(record, info.type);
  block.density_max = takeDensity(record, info.type);
  std::memcpy(block.occupancy.data(), record, occupancyBytes(info.block_side));
  return block;
}

Subblock decodeSubblockRecord(const std::byte* record, const VolumeInfo& info) {
  Subblock subblock;
  subblock.density_min = takeDensity(record, info.type);
  subblock.density_max = takeDensity(record, info.type);
  subblock.range_mask = take<std::uint8_t>(record);
  return subblock;
}

std::array<std::uint64_t, 4> insideMask(const VolumeInfo& info, glm::ivec3 level_dims, glm::ivec3 origin) {
  std::array<std::uint64_t, 4> mask{};
  const glm::ivec3 rest = level_dims - origin * info.blockVoxels();
  const glm::ivec3 inside = glm::min((rest + info.subblock_side - 1) / info.subblock_side, glm::ivec3(info.block_side));
  for (int z = 0; z < inside.z; ++z) {
    for (int y = 0; y < inside.y; ++y) {
      for (int x = 0; x < inside.x; ++x) {
        const auto local = static_cast<unsigned>(x + info.block_side * (y + info.block_side * z));
        mask[local / 64] |= std::uint64_t{1} << (local % 64);
      }
    }
  }
  return mask;
}

FileLayout layOutFile(const VolumeInfo& info) {
  BLOCKWALK_CHECK(info.levels.empty(), ==, false);
  FileLayout layout;
  layout.channels = info.channels.size();
  layout.entries.resize(info.levels.size() * layout.channels);
  const std::size_t channel_entries = layout.channels > 1 ? layout.channels * sizeof(ChannelEntry) : 0;
  layout.header_bytes = static_cast<std::uint32_t>(sizeof(FileHeader) + layout.entries.size() * sizeof(LevelEntry) +
                                                   channel_entries + info.source_name.size());
  std::uint64_t end = layout.header_bytes;
  for (std::size_t i = info.levels.size(); i-- > 0;) {
    const glm::ivec3 dims = levelDims(info.dims, static_cast<int>(i));
    for (std::size_t channel = 0; channel < layout.channels; ++channel) {
      LevelEntry& entry = layout.entry(i, channel);
      for (int axis = 0; axis < 3; ++axis) {
        entry.dims[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(dims[axis]);
      }
      entry.block_count = info.levels[i].block_count;
      entry.subblock_count = info.levels[i].subblock_count;
      const std::uint64_t voxel_bytes = entry.subblock_count * info.subblockVoxels() * voxelBytes(info.type);
      entry.blocks = placeSection(end, entry.block_count * blockRecordBytes(info.type, info.block_side));
      entry.subblocks = placeSection(end, entry.subblock_count * subblockRecordBytes(info.type));
      entry.chunk_checksums = placeSection(end, (voxel_bytes + kChunkBytes - 1) / kChunkBytes * sizeof(std::uint64_t));
      entry.voxels = placeSection(end, voxel_bytes);
    }
  }
  layout.file_bytes = end;
  return layout;
}

}  // namespace blockwalk
