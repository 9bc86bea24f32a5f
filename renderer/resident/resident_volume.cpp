// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/resident_volume.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "renderer/find/block_grid.h"
#include "renderer/find/octree.h"
#include "renderer/plan/density_scale.h"
#include "renderer/resident/ringed_layout.h"
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

// A voxel of a density alone; rgba8 has it without colour.
void writeDensity(VoxelType type, float density, std::byte* out) {
  const auto write = [&](auto value) { std::memcpy(out, &value, sizeof value); };
  switch (type) {
    case VoxelType::rgba8:
      return write(std::uint32_t{static_cast<std::uint8_t>(density)} << 24);
    case VoxelType::u8:
      return write(static_cast<std::uint8_t>(density));
    case VoxelType::u16:
      return write(static_cast<std::uint16_t>(density));
    case VoxelType::f32:
      return write(density);
  }
}

// Reads the voxels of consecutive blocks, one after the other.
using ReadBlocks = std::function<void(std::size_t first, std::size_t end, std::span<std::byte> out)>;

// Pieces of whole blocks, so that no reader sees a part of one.
void uploadBlocks(Device& device, const Buffer& buffer, const Chunk& chunk, const std::vector<Block>& blocks,
                  std::uint64_t subblock_bytes, const ReadBlocks& read) {
  constexpr std::uint64_t kPieceBytes = std::uint64_t{16} << 20;
  std::uint64_t offset = 0;
  for (std::size_t first = chunk.first_block; first < chunk.end_block;) {
    std::size_t end = first;
    std::uint64_t bytes = 0;
    while (end < chunk.end_block && (end == first || bytes < kPieceBytes)) {
      bytes += blocks[end++].subblock_count * subblock_bytes;
    }
    // A staging buffer of uploadBytes() holds several pieces; a larger block comes in parts of its own.
    std::vector<std::byte> whole;
    uploadBytes(device, buffer, offset, bytes, [&](std::uint64_t done, std::span<std::byte> piece) {
      if (piece.size() == bytes) {
        read(first, end, piece);
        return;
      }
      if (whole.empty()) {
        whole.resize(bytes);
        read(first, end, whole);
      }
      std::memcpy(piece.data(), whole.data() + done, piece.size());
    });
    offset += bytes;
    first = end;
  }
}

gpu::GpuBlock gpuBlock(const Block& block, int block_voxels, int exponent, std::uint64_t address) {
  gpu::GpuBlock record{};
  record.voxels = address;
  record.origin = block.origin * block_voxels;
  record.first_subblock = static_cast<std::uint32_t>(block.first_subblock);
  record.density_min = onDevice(block.density_min, exponent);
  record.density_max = onDevice(block.density_max, exponent);
  record.range_mask = block.range_mask;
  std::ranges::copy(block.neighbours, record.neighbours);
  fillIndices(block, record);
  return record;
}

}  // namespace

VulkanVolume::VulkanVolume(Device& device, VolumeFile file, std::uint64_t chunk_bytes)
    : device_(device), serial_(nextSerial()), file_(std::move(file)), chunk_bytes_(chunk_bytes) {
  const VolumeInfo& info = file_.info();
  const auto cube = [](int side) { return static_cast<std::uint64_t>(side) * static_cast<std::uint64_t>(side * side); };
  const std::uint64_t largest_block = cube(info.block_side) * ringedSubblockBytes(info);
  chunk_bytes_ = std::max(std::min(chunk_bytes_, device.maxAllocationBytes()), largest_block);
  levels_.resize(4 * info.levels.size());
}

std::vector<ResidentPart> VulkanVolume::parts() const {
  std::vector<ResidentPart> parts;
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    if (!levels_[i]) continue;
    const ResidentLevel& level = *levels_[i];
    const auto add = [&](std::string what, int channel, std::uint64_t bytes) {
      if (bytes == 0) return;
      parts.push_back({.what = std::move(what),
                       .level = static_cast<int>(i / 4),
                       .apron = i % 2 != 0,
                       .channel = channel,
                       .bytes = bytes});
    };
    for (std::size_t c = 0; c < level.channels.size(); ++c) {
      if (!level.channels[c]) continue;
      const ResidentChannel& channel = *level.channels[c];
      const auto number = static_cast<int>(c);
      std::uint64_t voxels = 0;
      for (const Buffer& chunk : channel.voxel_chunks) voxels += chunk.bytes();
      add("voxels", number, voxels);
      add("blocks", number, channel.blocks.bytes());
      add("masks", number, channel.masks.bytes());
      add("empty", number, channel.empty.bytes());
      std::uint64_t macrocells = 0;
      for (const auto& [side, cells] : channel.macrocells) macrocells += cells.ranges.bytes();
      add("macrocells", number, macrocells);
      std::uint64_t cells = 0;
      for (const ResidentCells& of_range : channel.visible_cells) cells += of_range.cells.bytes();
      add("cells", number, cells);
    }
    if (level.grid) add("grid", ResidentPart::kAllChannels, level.grid->tiles.bytes() + level.grid->cells.bytes());
    for (const auto& octree : level.octrees) {
      if (octree) add("octree", ResidentPart::kAllChannels, octree->nodes.bytes());
    }
    if (level.instances) add("instances", ResidentPart::kAllChannels, level.instances->storage.bytes());
  }
  return parts;
}

std::uint64_t VulkanVolume::deviceBytes() const {
  std::uint64_t bytes = 0;
  for (const ResidentPart& part : parts()) bytes += part.bytes;
  return bytes;
}

ResidentLevel& VulkanVolume::level(int number, Form form, bool apron, std::span<const std::size_t> channels) {
  auto& level = levels_.at(4 * static_cast<std::size_t>(number) + (form == Form::maxima ? 2 : 0) + (apron ? 1 : 0));
  auto loading = level ? nullptr : std::make_unique<ResidentLevel>();
  ResidentLevel& resident = level ? *level : *loading;
  std::optional<ApronLevel> found;
  for (const std::size_t channel : channels) {
    if (resident.channels.at(channel)) continue;
    if (!apron) {
      loadStored(number, form, channel, resident);
    } else if (!found) {
      loadWithApron(found.emplace(file_, number, static_cast<int>(channel), form), channel, resident);
    } else {
      ApronLevel other(*found, static_cast<int>(channel));
      loadWithApron(other, channel, resident);
    }
  }
  if (loading) level = std::move(loading);
  return resident;
}

void VulkanVolume::loadStored(int number, Form form, std::size_t channel, ResidentLevel& level) {
  const VolumeInfo& info = file_.info();
  const auto file_channel = static_cast<int>(channel);
  Level records = file_.readLevel(number, file_channel, form);
  const std::vector<Block>& blocks = records.blocks;
  const auto read = [&](std::size_t first, std::size_t end, std::span<std::byte> out) {
    const std::uint64_t bytes = info.subblockVoxels() * voxelBytes(info.type);
    file_.readVoxels(number, file_channel, blocks[first].first_subblock, out.size() / bytes, out, form);
    BLOCKWALK_CHECK(blocks[end - 1].first_subblock + blocks[end - 1].subblock_count, ==,
                    blocks[first].first_subblock + out.size() / bytes);
  };
  upload(records, channel, info.subblockVoxels() * voxelBytes(info.type), read, level);
}

void VulkanVolume::loadWithApron(ApronLevel& apron, std::size_t channel, ResidentLevel& level) {
  Level records = apron.records();
  const std::uint64_t device_bytes = ringedSubblockBytes(file_.info());
  std::vector<std::byte> plain;
  const auto read = [&](std::size_t first, std::size_t end, std::span<std::byte> out) {
    for (std::size_t block = first; block < end; ++block) {
      const std::size_t subblocks = records.blocks[block].subblock_count;
      plain.resize(subblocks * apron.subblockBytes());
      apron.readBlock(block, plain);
      layOutRinged(file_.info(), plain, out.first(subblocks * device_bytes));
      out = out.subspan(subblocks * device_bytes);
    }
  };
  upload(records, channel, device_bytes, read, level);
}

void VulkanVolume::upload(Level& records, std::size_t channel, std::uint64_t subblock_bytes, const ReadBlocks& read,
                          ResidentLevel& level) {
  const std::vector<Block>& blocks = records.blocks;
  BLOCKWALK_CHECK(records.subblocks.size(), <, gpu::kNone);
  const int exponent = densityExponent(info(), channel);
  const auto read_scaled = [&](std::size_t first, std::size_t end, std::span<std::byte> out) {
    read(first, end, out);
    toDevice(out, exponent);
  };
  ResidentChannel resident;
  std::vector<gpu::GpuBlock> gpu_blocks;
  gpu_blocks.reserve(blocks.size());
  for (const Chunk& chunk : cutIntoChunks(blocks, subblock_bytes, chunk_bytes_)) {
    Buffer& buffer = resident.voxel_chunks.emplace_back(device_, chunk.bytes, BufferUse::resident);
    uploadBlocks(device_, buffer, chunk, blocks, subblock_bytes, read_scaled);
    const std::uint64_t first = blocks[chunk.first_block].first_subblock;
    for (std::size_t i = chunk.first_block; i < chunk.end_block; ++i) {
      const std::uint64_t offset = (blocks[i].first_subblock - first) * subblock_bytes;
      gpu_blocks.push_back(gpuBlock(blocks[i], info().blockVoxels(), exponent, buffer.address() + offset));
    }
  }
  resident.blocks = uploadVector(device_, gpu_blocks);
  resident.ranges.resize(records.subblocks.size());
  std::ranges::transform(records.subblocks, resident.ranges.begin(), [&](const Subblock& s) {
    return gpu::GpuSubblock{.density_min = onDevice(s.density_min, exponent),
                            .density_max = onDevice(s.density_max, exponent),
                            .range_mask = s.range_mask};
  });
  if (level.records.blocks.empty()) {
    level.records = std::move(records);
    const bool alone = info().channels.size() == 1;
    for (const Subblock& s : level.records.subblocks) level.subblock_masks.push_back(alone ? s.range_mask : 0xff);
    level.records.subblocks = {};
    if (!alone) {
      for (Block& block : level.records.blocks) block.range_mask = 0xff;
    }
  }
  level.channels[channel] = std::move(resident);
}

const Buffer& VulkanVolume::masks(ResidentChannel& channel) {
  if (channel.masks.bytes() == 0) {
    channel.masks = uploadVector(device_, channel.ranges);
    channel.ranges = {};  // only the device needs them from here on
  }
  return channel.masks;
}

const Buffer& VulkanVolume::emptySubblock(ResidentChannel& channel, std::size_t number, bool apron) {
  if (channel.empty.bytes() == 0) {
    // Every voxel is the same, so their order does not matter.
    const std::uint64_t plain_bytes = info().subblockVoxels() * voxelBytes(info().type);
    const float value = emptyValue(info().type, info().channels[number]);
    std::vector<std::byte> voxels(apron ? ringedSubblockBytes(info()) : plain_bytes);
    for (std::size_t at = 0; at < voxels.size(); at += voxelBytes(info().type)) {
      writeDensity(info().type, value, voxels.data() + at);
    }
    toDevice(voxels, densityExponent(info(), number));
    channel.empty = uploadVector(device_, voxels);
  }
  return channel.empty;
}

const OctreeBuffer& VulkanVolume::octree(ResidentLevel& level, OctreeLeaves leaves) {
  std::unique_ptr<OctreeBuffer>& octree = level.octrees[static_cast<std::size_t>(leaves)];
  if (!octree) {
    const Octree built = buildOctree(leaves == OctreeLeaves::blocks
                                         ? blockLeaves(level.records)
                                         : subblockLeaves(level.records, level.subblock_masks, info().block_side));
    octree =
        std::make_unique<OctreeBuffer>(OctreeBuffer{.depth = built.depth, .nodes = uploadVector(device_, built.nodes)});
  }
  return *octree;
}

const GridBuffers& VulkanVolume::grid(ResidentLevel& level) {
  if (!level.grid) {
    const BlockGrid grid = buildBlockGrid(level.records, info().blockVoxels());
    level.grid = std::make_unique<GridBuffers>(GridBuffers{.tile_dims = grid.tile_dims,
                                                           .tiles = uploadVector(device_, grid.tiles),
                                                           .cells = uploadVector(device_, grid.cells)});
  }
  return *level.grid;
}

const AccelerationStructure& VulkanVolume::instances(ResidentLevel& level, const AccelerationStructure& unit_box) {
  if (!level.instances) {
    level.instances = std::make_unique<AccelerationStructure>(
        buildBlockInstances(device_, unit_box, level.records, info().blockVoxels()));
  }
  return *level.instances;
}

void VulkanVolume::drop(Finder finder) {
  for (const auto& level : levels_) {
    if (level == nullptr) continue;
    if (finder == Finder::query) level->instances.reset();
    if (finder == Finder::grid) level->grid.reset();
  }
}

}  // namespace blockwalk
