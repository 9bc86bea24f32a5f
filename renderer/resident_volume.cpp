// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident_volume.h"

#include <algorithm>
#include <atomic>

#include "renderer/grid.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

// Where a run of whole blocks lies: in one chunk of voxel memory.
struct Chunk {
  std::size_t first_block = 0;
  std::size_t end_block = 0;
  std::uint64_t bytes = 0;
};

std::vector<Chunk> cutIntoChunks(const std::vector<Block>& blocks, std::uint64_t subblock_bytes,
                                 std::uint64_t chunk_bytes) {
  std::vector<Chunk> chunks;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const std::uint64_t bytes = blocks[i].subblock_count * subblock_bytes;
    if (chunks.empty() || chunks.back().bytes + bytes > chunk_bytes)
      chunks.push_back({.first_block = i, .end_block = i});
    chunks.back().end_block = i + 1;
    chunks.back().bytes += bytes;
  }
  return chunks;
}

// 8-bit subblock indices from the occupancy bits: the rank of every stored subblock (Derin et al. 2021, section 3).
void fillIndices(const Block& block, gpu::GpuBlock& record) {
  std::uint32_t rank = 0;
  for (std::uint32_t word = 0; word < 54; ++word) {
    std::uint32_t packed = 0;
    for (std::uint32_t byte = 0; byte < 4; ++byte) {
      const std::uint32_t local = 4 * word + byte;
      const bool stored = (block.occupancy[local / 64] >> (local % 64) & 1u) != 0;
      packed |= (stored ? rank++ : gpu::kNoSubblock) << (8 * byte);
    }
    record.indices[word] = packed;
  }
}

std::uint64_t nextSerial() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

template <typename T>
Buffer uploadVector(Device& device, const std::vector<T>& values) {
  Buffer buffer(device, values.size() * sizeof(T), BufferUse::resident);
  uploadBytes(device, buffer, std::as_bytes(std::span(values)));
  return buffer;
}

}  // namespace

VulkanVolume::VulkanVolume(Device& device, VolumeFile file, std::uint64_t chunk_bytes)
    : device_(device), serial_(nextSerial()), file_(std::move(file)), chunk_bytes_(chunk_bytes) {
  const VolumeInfo& info = file_.info();
  const std::uint64_t largest_block = info.subblockVoxels() * voxelBytes(info.type) *
                                      static_cast<std::uint64_t>(info.block_side * info.block_side * info.block_side);
  chunk_bytes_ = std::max(std::min(chunk_bytes_, device.maxAllocationBytes()), largest_block);
  levels_.resize(info.levels.size());
}

std::uint64_t VulkanVolume::deviceBytes() const {
  std::uint64_t bytes = 0;
  for (const auto& level : levels_) {
    if (!level) continue;
    bytes += level->blocks.bytes() + level->subblocks.bytes();
    for (const Buffer& chunk : level->voxel_chunks) bytes += chunk.bytes();
    if (level->grid) bytes += level->grid->tiles.bytes() + level->grid->cells.bytes();
    if (level->instances) bytes += level->instances->storage.bytes();
  }
  return bytes;
}

ResidentLevel& VulkanVolume::level(int number) {
  auto& level = levels_.at(static_cast<std::size_t>(number));
  if (!level) level = loadLevel(number);
  return *level;
}

std::unique_ptr<ResidentLevel> VulkanVolume::loadLevel(int number) {
  const VolumeInfo& info = file_.info();
  auto level = std::make_unique<ResidentLevel>();
  level->records = file_.readLevel(number);
  const std::vector<Block>& blocks = level->records.blocks;
  BLOCKWALK_CHECK(level->records.subblocks.size(), <, gpu::kNone);
  const std::uint64_t subblock_bytes = info.subblockVoxels() * voxelBytes(info.type);

  std::vector<gpu::GpuBlock> records(blocks.size());
  for (const Chunk& chunk : cutIntoChunks(blocks, subblock_bytes, chunk_bytes_)) {
    Buffer& buffer = level->voxel_chunks.emplace_back(device_, chunk.bytes, BufferUse::resident);
    const std::uint64_t first_subblock = blocks[chunk.first_block].first_subblock;
    uploadBytes(device_, buffer, 0, chunk.bytes, [&](std::uint64_t offset, std::span<std::byte> piece) {
      file_.readVoxels(number, first_subblock + offset / subblock_bytes, piece.size() / subblock_bytes, piece);
    });
    for (std::size_t i = chunk.first_block; i < chunk.end_block; ++i) {
      const Block& block = blocks[i];
      gpu::GpuBlock& record = records[i];
      record.voxels = buffer.address() + (block.first_subblock - first_subblock) * subblock_bytes;
      record.origin = block.origin * info.blockVoxels();
      record.first_subblock = static_cast<std::uint32_t>(block.first_subblock);
      record.density_min = block.density_min;
      record.density_max = block.density_max;
      record.range_mask = block.range_mask;
      std::ranges::copy(block.neighbours, record.neighbours);
      fillIndices(block, record);
    }
  }
  level->blocks = uploadVector(device_, records);
  std::vector<gpu::GpuSubblock> subblocks(level->records.subblocks.size());
  std::ranges::transform(level->records.subblocks, subblocks.begin(), [](const Subblock& s) {
    return gpu::GpuSubblock{.density_min = s.density_min, .density_max = s.density_max, .range_mask = s.range_mask};
  });
  level->subblocks = uploadVector(device_, subblocks);
  level->records.subblocks = {};  // only the device needs them from here on
  return level;
}

const GridBuffers& VulkanVolume::grid(int number) {
  ResidentLevel& resident = level(number);
  if (!resident.grid) {
    const BlockGrid grid = buildBlockGrid(resident.records, info().blockVoxels());
    resident.grid = std::make_unique<GridBuffers>(GridBuffers{.tile_dims = grid.tile_dims,
                                                              .tiles = uploadVector(device_, grid.tiles),
                                                              .cells = uploadVector(device_, grid.cells)});
  }
  return *resident.grid;
}

const AccelerationStructure& VulkanVolume::instances(int number, const AccelerationStructure& unit_box) {
  ResidentLevel& resident = level(number);
  if (!resident.instances) {
    resident.instances = std::make_unique<AccelerationStructure>(
        buildBlockInstances(device_, unit_box, resident.records, info().blockVoxels()));
  }
  return *resident.instances;
}

}  // namespace blockwalk
