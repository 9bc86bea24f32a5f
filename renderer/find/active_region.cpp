// SPDX-License-Identifier: Apache-2.0
#include "renderer/find/active_region.h"

#include <algorithm>
#include <chrono>

#include "renderer/find/clusters.h"

namespace blockwalk {
namespace {

// Boxes and faces enclose the active cells with this much to spare, so that whatever ray the exact planes take through
// one meets its box or face in the driver's arithmetic too. A coordinate of 65536 has a rounding of 1/128 voxel.
constexpr float kSlackShare = 1.0f / 16;  // of a cell

// Beyond this many bytes room for vertices is made when they are known to be so many.
constexpr std::uint64_t kPreallocatedBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kFaceBytes = gpu::kFaceFloats * sizeof(float);

std::uint64_t cellCount(glm::ivec3 dims) {
  return static_cast<std::uint64_t>(dims.x) * static_cast<std::uint64_t>(dims.y) * static_cast<std::uint64_t>(dims.z);
}

// Wall time of a stage, waiting for the device included.
template <typename Work>
double timed(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

// What a kernel has written is there for the next, for builds and for the host.
void makeVisible(const vk::raii::CommandBuffer& commands) {
  const vk::MemoryBarrier all{.srcAccessMask = vk::AccessFlagBits::eShaderWrite,
                              .dstAccessMask = vk::AccessFlagBits::eMemoryRead | vk::AccessFlagBits::eMemoryWrite};
  commands.pipelineBarrier(vk::PipelineStageFlagBits::eComputeShader,
                           vk::PipelineStageFlagBits::eAllCommands | vk::PipelineStageFlagBits::eHost, {}, all, {}, {});
}

void reserve(Device& device, Buffer& buffer, std::uint64_t bytes, BufferUse use) {
  if (buffer.bytes() < bytes) buffer = Buffer(device, bytes, use);
}

}  // namespace

glm::ivec3 macrocellDims(glm::ivec3 level_dims, int cell_voxels) {
  return (level_dims + (cell_voxels - 1)) / cell_voxels;
}

const ActiveRegion& ActiveRegions::clusters(VulkanVolume& volume, ResidentLevel& level, RegionKey key) {
  return rebuilt(clusters_, volume, level, std::move(key), &ActiveRegions::mergeBoxes);
}

const ActiveRegion& ActiveRegions::boundary(VulkanVolume& volume, ResidentLevel& level, RegionKey key) {
  return rebuilt(boundary_, volume, level, std::move(key), &ActiveRegions::extractBoundary);
}

void ActiveRegions::forget() {
  clusters_.key = {};
  boundary_.key = {};
}

const ActiveRegion& ActiveRegions::rebuilt(ActiveRegion& region, VulkanVolume& volume, ResidentLevel& level,
                                           RegionKey key, Build build) {
  region.build.rebuilt = region.key != key;
  if (!region.build.rebuilt) return region;
  region.key = {};  // until all of it is there: memory may run out below
  makeMacrocells(volume, level, key);
  region.cell_dims = macrocellDims(level.records.info.dims, key.cell_voxels);
  region.top = {};
  region.bottom = {};
  region.build = {.rebuilt = true, .cell_voxels = key.cell_voxels, .cells = cellCount(region.cell_dims)};
  ActiveRegion next = std::move(region);
  next.key = std::move(key);
  next.build.total_ms = timed([&] {
    next.build.tf_ms = timed([&] { classify(next, level); });
    if (next.build.active_cells > 0) {
      (this->*build)(next);
    } else {
      next.bottom = buildUnitBox(device_);
      next.top = buildOneInstance(device_, next.bottom, 0);
    }
  });
  region = std::move(next);
  return region;
}

// Once a level, cell size and channel: ranges do not change.
void ActiveRegions::makeMacrocells(VulkanVolume& volume, ResidentLevel& level, const RegionKey& key) {
  const glm::ivec3 dims = macrocellDims(level.records.info.dims, key.cell_voxels);
  const GridBuffers& grid = volume.grid(level);
  reserve(device_, counter_, sizeof(std::uint32_t), BufferUse::readback);
  for (const RegionChannel& drawn : key.channels) {
    ResidentChannel& channel = *level.channels[drawn.channel];
    if (channel.macrocells.contains(key.cell_voxels)) continue;
    Buffer ranges(device_, cellCount(dims) * sizeof(gpu::GpuSubblock), BufferUse::resident);
    const gpu::MacrocellPush push{.blocks = channel.blocks.address(),
                                  .subblocks = volume.masks(channel).address(),
                                  .grid_tiles = grid.tiles.address(),
                                  .grid_cells = grid.cells.address(),
                                  .ranges = ranges.address(),
                                  .occupied = counter_.address(),
                                  .tile_dims = grid.tile_dims,
                                  .cell_dims = dims,
                                  .cell_voxels = key.cell_voxels,
                                  .subblock_side = volume.info().subblock_side,
                                  .block_side = volume.info().block_side};
    counter_.mappedAs<std::uint32_t>()[0] = 0;
    device_.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
      kernels_.dispatch(commands, RegionKernel::macrocells, push, dims);
      makeVisible(commands);
    });
    const std::uint32_t occupied = counter_.mappedAs<std::uint32_t>()[0];
    channel.macrocells.emplace(key.cell_voxels, Macrocells{.ranges = std::move(ranges), .occupied = occupied});
  }
}

void ActiveRegions::classify(ActiveRegion& region, const ResidentLevel& level) {
  const RegionKey& key = region.key;
  const std::uint64_t cells = cellCount(region.cell_dims);
  reserve(device_, classified_, cells, BufferUse::readback);
  reserve(device_, region.states, (cells + 3) / 4 * 4, BufferUse::resident);  // the render kernel reads words
  region.occupied = 0;
  std::vector<glm::vec2> intervals;
  for (const RegionChannel& drawn : key.channels) {
    for (const StoredRange& range : drawn.densities) intervals.emplace_back(range.lo, range.hi);
  }
  const Buffer visible = uploadVector(device_, intervals);
  gpu::ClassifyPush push{};
  std::uint64_t next = visible.address();
  for (std::size_t i = 0; i < key.channels.size(); ++i) {
    const RegionChannel& drawn = key.channels[i];
    push.channels[i] = {.ranges = level.channels[drawn.channel]->macrocells.at(key.cell_voxels).ranges.address(),
                        .intervals = next,
                        .interval_count = static_cast<gpu::uint>(drawn.densities.size()),
                        .range_mask = drawn.range_mask};
    next += drawn.densities.size() * sizeof(glm::vec2);
    region.occupied += level.channels[drawn.channel]->macrocells.at(key.cell_voxels).occupied;
  }
  push.states = classified_.address();
  push.cell_count = static_cast<gpu::uint>(cells);
  push.channel_count = static_cast<gpu::uint>(key.channels.size());
  const gpu::SurroundPush surround{.states = classified_.address(),
                                   .surrounded = region.states.address(),
                                   .active_count = counter_.address(),
                                   .cell_dims = region.cell_dims};
  counter_.mappedAs<std::uint32_t>()[0] = 0;
  device_.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
    kernels_.dispatch(commands, RegionKernel::classify, push, region.cell_dims);
    makeVisible(commands);
    kernels_.dispatch(commands, RegionKernel::surround, surround, region.cell_dims);
    makeVisible(commands);
  });
  region.build.active_cells = counter_.mappedAs<std::uint32_t>()[0];
}

void ActiveRegions::mergeBoxes(ActiveRegion& region) {
  std::vector<glm::vec3> corners;
  region.build.tris_ms = timed([&] {
    const auto states = classified_.mappedAs<std::uint8_t>().first(cellCount(region.cell_dims));
    const auto side = static_cast<float>(region.key.cell_voxels);
    for (const CellBox& box : mergeCells({states.begin(), states.end()}, region.cell_dims)) {
      corners.push_back(side * glm::vec3(box.lo));
      corners.push_back(side * glm::vec3(box.hi));
    }
  });
  region.build.primitives = corners.size() / 2;
  region.build.bvh_ms = timed([&] {
    region.boxes = uploadVector(device_, corners);
    const Buffer enlarged(device_, corners.size() / 2 * sizeof(VkAabbPositionsKHR), BufferUse::instances);
    const auto boxes = enlarged.mappedAs<VkAabbPositionsKHR>();
    const glm::vec3 slack(kSlackShare * static_cast<float>(region.key.cell_voxels));
    for (std::size_t i = 0; i < region.build.primitives; ++i) {
      const glm::vec3 lo = corners[2 * i] - slack;
      const glm::vec3 hi = corners[2 * i + 1] + slack;
      boxes[i] = {.minX = lo.x, .minY = lo.y, .minZ = lo.z, .maxX = hi.x, .maxY = hi.y, .maxZ = hi.z};
    }
    region.bottom = buildBoxes(device_, enlarged, static_cast<std::uint32_t>(region.build.primitives));
    region.top = buildOneInstance(device_, region.bottom);
  });
  region.build.bytes =
      region.states.bytes() + region.boxes.bytes() + region.bottom.storage.bytes() + region.top.storage.bytes();
}

// Returns how many there are, of which those that there was room for are written.
std::uint32_t ActiveRegions::writeFaces(const ActiveRegion& region) {
  const auto side = static_cast<float>(region.key.cell_voxels);
  const gpu::BoundaryPush push{.states = classified_.address(),
                               .vertices = vertices_.address(),
                               .face_count = counter_.address(),
                               .capacity = static_cast<gpu::uint>(vertices_.bytes() / kFaceBytes),
                               .cell_dims = region.cell_dims,
                               .cell_voxels = side,
                               .slack = kSlackShare * side};
  counter_.mappedAs<std::uint32_t>()[0] = 0;
  device_.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
    kernels_.dispatch(commands, RegionKernel::faces_x, push, region.cell_dims + glm::ivec3(1, 0, 0));
    kernels_.dispatch(commands, RegionKernel::faces_y, push, region.cell_dims + glm::ivec3(0, 1, 0));
    kernels_.dispatch(commands, RegionKernel::faces_z, push, region.cell_dims + glm::ivec3(0, 0, 1));
    makeVisible(commands);
  });
  return counter_.mappedAs<std::uint32_t>()[0];
}

void ActiveRegions::extractBoundary(ActiveRegion& region) {
  std::uint32_t faces = 0;
  region.build.tris_ms = timed([&] {
    const std::uint64_t most = 6 * region.occupied;
    reserve(device_, vertices_, std::min(most * kFaceBytes, kPreallocatedBytes), BufferUse::geometry);
    faces = writeFaces(region);
    if (faces * kFaceBytes > vertices_.bytes()) {
      vertices_ = Buffer(device_, faces * kFaceBytes, BufferUse::geometry);
      faces = writeFaces(region);
    }
  });
  region.build.primitives = 2 * faces;
  region.build.bvh_ms = timed([&] {
    region.bottom = buildTriangles(device_, vertices_, 2 * faces);
    region.top = buildOneInstance(device_, region.bottom);
  });
  region.build.bytes =
      region.states.bytes() + vertices_.bytes() + region.bottom.storage.bytes() + region.top.storage.bytes();
}

}  // namespace blockwalk
