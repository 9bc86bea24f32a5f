// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/dense_volume.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "volume/error.h"

#include "tests/reference/field.h"

namespace blockwalk::reference {
namespace {

// By the rule in docs/integration.md, "Light".
double highDensityOf(const ChannelInfo& channel) {
  std::size_t bin = 0;
  double seen = static_cast<double>(channel.histogram[0]);
  while (seen < 0.998 * static_cast<double>(channel.nonempty_voxels)) {
    seen += static_cast<double>(channel.histogram.at(++bin));
  }
  const double lo = channel.histogram_lo;
  const double edge = lo + static_cast<double>(bin + 1) * (channel.histogram_hi - lo) / 256;
  return std::min(edge, static_cast<double>(channel.density_max));
}

std::size_t linear(glm::ivec3 position, glm::ivec3 dims) {
  BLOCKWALK_CHECK(std::min({position.x, position.y, position.z}), >=, 0);
  BLOCKWALK_CHECK(position.x, <, dims.x);
  BLOCKWALK_CHECK(position.y, <, dims.y);
  BLOCKWALK_CHECK(position.z, <, dims.z);
  return (static_cast<std::size_t>(position.z) * static_cast<std::size_t>(dims.y) +
          static_cast<std::size_t>(position.y)) *
             static_cast<std::size_t>(dims.x) +
         static_cast<std::size_t>(position.x);
}

std::size_t count(glm::ivec3 dims) {
  return static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z);
}

void decode(DenseVolume& volume, std::size_t voxel, const std::byte* bytes) {
  volume.density[voxel] = storedDensity(volume.type, bytes);
  if (volume.type != VoxelType::rgba8) return;
  for (std::size_t c = 0; c < 3; ++c) volume.color[voxel][c] = std::to_integer<std::uint8_t>(bytes[c]);
}

void allocate(DenseVolume& volume) {
  volume.density.assign(count(volume.dims), std::numeric_limits<float>::quiet_NaN());
  if (volume.type == VoxelType::rgba8) volume.color.assign(count(volume.dims), {});
}

void shapeBlocks(DenseVolume& volume, int block_voxels) {
  volume.block_voxels = block_voxels;
  volume.block_dims = (volume.dims + block_voxels - 1) / block_voxels;
  volume.blocks.assign(count(volume.block_dims), {});
}

template <typename Function>
void forEachVoxel(glm::ivec3 begin, glm::ivec3 end, Function function) {
  for (int z = begin.z; z < end.z; ++z) {
    for (int y = begin.y; y < end.y; ++y) {
      for (int x = begin.x; x < end.x; ++x) function(glm::ivec3(x, y, z));
    }
  }
}

// Voxels beyond the volume's dims fill up the subblocks on its far faces; they are nobody's.
void copySubblock(DenseVolume& volume, const std::byte* bytes, glm::ivec3 first_voxel, int side) {
  const std::size_t voxel_bytes = voxelBytes(volume.type);
  forEachVoxel(glm::ivec3(0), glm::min(glm::ivec3(side), volume.dims - first_voxel), [&](glm::ivec3 local) {
    decode(volume, volume.at(first_voxel + local), bytes + linear(local, glm::ivec3(side)) * voxel_bytes);
  });
}

void copyBlock(DenseVolume& volume, const VolumeFile& file, const Block& block, Form form) {
  const VolumeInfo& info = file.info();
  const std::size_t subblock_bytes = info.subblockVoxels() * voxelBytes(info.type);
  std::vector<std::byte> bytes(block.subblock_count * subblock_bytes);
  file.readVoxels(volume.level, static_cast<int>(volume.channel), block.first_subblock, block.subblock_count, bytes,
                  form);
  std::size_t next = 0;
  forEachVoxel(glm::ivec3(0), glm::ivec3(info.block_side), [&](glm::ivec3 local) {
    const std::size_t bit = linear(local, glm::ivec3(info.block_side));
    if ((block.occupancy[bit / 64] >> (bit % 64) & 1) == 0) return;
    const glm::ivec3 first_voxel = block.origin * info.blockVoxels() + local * info.subblock_side;
    copySubblock(volume, bytes.data() + next * subblock_bytes, first_voxel, info.subblock_side);
    ++next;
  });
  BLOCKWALK_CHECK(next, ==, block.subblock_count);
}

}  // namespace

std::size_t DenseVolume::at(glm::ivec3 voxel) const { return linear(voxel, dims); }

std::size_t DenseVolume::blockAt(glm::ivec3 block) const { return linear(block, block_dims); }

int DenseVolume::binOf(float stored) const {
  return static_cast<int>(std::ranges::count_if(bin_cuts, [&](float cut) { return cut <= stored; }));
}

DenseVolume emptyVolume(VoxelType type, glm::ivec3 dims) {
  DenseVolume volume{.type = type, .level0_dims = dims, .dims = dims};
  allocate(volume);
  shapeBlocks(volume, volume.block_voxels);
  return volume;
}

void deriveBlocks(DenseVolume& volume, int block_voxels) {
  shapeBlocks(volume, block_voxels);
  forEachVoxel(glm::ivec3(0), volume.dims, [&](glm::ivec3 voxel) {
    const float density = volume.density[volume.at(voxel)];
    if (!std::isfinite(density) || density <= volume.empty_threshold) return;
    BlockRange& range = volume.blocks[volume.blockAt(voxel / block_voxels)];
    range = {.stored = true,
             .density_min = range.stored ? std::min(range.density_min, density) : density,
             .density_max = range.stored ? std::max(range.density_max, density) : density,
             .bins = static_cast<std::uint8_t>(range.bins | 1u << volume.binOf(density))};
  });
}

DenseVolume volumeFromSource(Source& source, float empty_threshold, int block_voxels) {
  const SourceInfo& info = source.info();
  DenseVolume volume = emptyVolume(info.type, info.dims);
  volume.world_from_index = info.world_from_index;
  volume.value_scale = info.channels[0].value_scale;
  volume.value_offset = info.channels[0].value_offset;
  volume.empty_threshold = empty_threshold;
  const std::size_t voxel_bytes = voxelBytes(info.type);
  const std::size_t slice = static_cast<std::size_t>(info.dims.x) * static_cast<std::size_t>(info.dims.y);
  std::vector<std::byte> bytes(slice * voxel_bytes);
  for (int z = 0; z < info.dims.z; ++z) {
    source.readRows(z, 0, info.dims.y, bytes);
    for (std::size_t i = 0; i < slice; ++i) {
      decode(volume, static_cast<std::size_t>(z) * slice + i, bytes.data() + i * voxel_bytes);
    }
  }
  deriveBlocks(volume, block_voxels);
  return volume;
}

DenseVolume volumeFromFile(const VolumeFile& file, int level, std::size_t number, Form form) {
  const VolumeInfo& info = file.info();
  const ChannelInfo& channel = info.channels.at(number);
  const Level records = file.readLevel(level, static_cast<int>(number), form);
  DenseVolume volume{.type = info.type,
                     .channel = number,
                     .level0_dims = info.dims,
                     .level = level,
                     .dims = records.info.dims,
                     .world_from_index = info.world_from_index,
                     .value_scale = channel.value_scale,
                     .value_offset = channel.value_offset,
                     .empty_threshold = channel.empty_threshold};
  const double end0 = channel.dataFromStored(static_cast<double>(channel.density_min));
  const double end1 = channel.dataFromStored(static_cast<double>(channel.density_max));
  if (channel.nonempty_voxels > 0) volume.level0_extent = {.min = std::min(end0, end1), .max = std::max(end0, end1)};
  if (channel.nonempty_voxels > 0) volume.contrast = highDensityOf(channel) - emptyValue(volume);
  volume.subblock_side = info.subblock_side;
  volume.bin_cuts = channel.bin_cuts;
  allocate(volume);
  shapeBlocks(volume, info.blockVoxels());
  for (const Block& block : records.blocks) {
    volume.blocks[volume.blockAt(block.origin)] = {
        .stored = true, .density_min = block.density_min, .density_max = block.density_max, .bins = block.range_mask};
    copyBlock(volume, file, block, form);
  }
  return volume;
}

}  // namespace blockwalk::reference
