// SPDX-License-Identifier: Apache-2.0
#include "renderer/find/active_region.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>

#include "renderer/find/clusters.h"
#include "renderer/resident/at_once.h"

namespace blockwalk {
namespace {

// Boxes and faces enclose the active macrocells with this much to spare, so that whatever ray the exact planes take
// through one meets its box or face in the driver's arithmetic too. A coordinate of 65536 has a rounding of 1/128
// voxel.
constexpr float kSlackShare = 1.0f / 16;  // of a macrocell

// Beyond this many bytes room for vertices is made when they are known to be so many.
constexpr std::uint64_t kPreallocatedBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kFaceBytes = gpu::kFaceFloats * sizeof(float);

std::uint64_t macrocellCount(glm::ivec3 dims) {
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

glm::ivec3 macrocellDims(glm::ivec3 level_dims, int macrocell_voxels) {
  return (level_dims + (macrocell_voxels - 1)) / macrocell_voxels;
}

// Ranges do not change: once a level, macrocell size and channel.
std::unique_ptr<Making> ActiveRegions::makeMacrocells(const StoredVolume& volume, const Need& need,
                                                      std::shared_ptr<const ResidentBlocks> blocks,
                                                      std::shared_ptr<const ResidentMasks> masks,
                                                      std::shared_ptr<const ResidentGrid> grid) {
  return makeAtOnce(
      [this, file = volume.file, need, blocks = std::move(blocks), masks = std::move(masks), grid = std::move(grid)] {
        const VolumeInfo& info = file->info();
        const glm::ivec3 dims = macrocellDims(info.level(need.level, need.form).dims, need.macrocell_voxels);
        const Buffer counter(device_, sizeof(std::uint32_t), BufferUse::readback);
        auto made = std::make_unique<ResidentMacrocells>();
        made->ranges = Buffer(device_, macrocellCount(dims) * sizeof(gpu::GpuSubblock), BufferUse::resident);
        const gpu::MacrocellPush push{.blocks = blocks->records.address(),
                                      .subblocks = masks->records.address(),
                                      .grid_tiles = grid->tiles.address(),
                                      .grid_blocks = grid->blocks.address(),
                                      .ranges = made->ranges.address(),
                                      .occupied = counter.address(),
                                      .tile_dims = grid->tile_dims,
                                      .macrocell_dims = dims,
                                      .macrocell_voxels = need.macrocell_voxels,
                                      .subblock_side = info.subblock_side,
                                      .block_side = info.block_side};
        counter.mappedAs<std::uint32_t>()[0] = 0;
        device_.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
          kernels_.dispatch(commands, RegionKernel::macrocells, push, dims);
          makeVisible(commands);
        });
        made->occupied = counter.mappedAs<std::uint32_t>()[0];
        return made;
      });
}

// Classifies; merges on a thread of the host's, or writes faces; builds: a piece each.
class ActiveRegions::RegionMaking final : public Making {
 public:
  RegionMaking(ActiveRegions& regions, glm::ivec3 level_dims, const Need& need,
               std::vector<std::shared_ptr<const ResidentMacrocells>> macrocells)
      : regions_(regions),
        device_(regions.device_),
        need_(need),
        macrocells_(std::move(macrocells)),
        scratch_(std::exchange(regions.spare_, {})),
        made_(std::make_unique<ResidentRegion>()) {
    made_->macrocell_dims = macrocellDims(level_dims, need.macrocell_voxels);
    made_->build = {.macrocell_voxels = need.macrocell_voxels, .macrocells = macrocellCount(made_->macrocell_dims)};
    for (const auto& of_channel : macrocells_) occupied_ += of_channel->occupied;
  }
  ~RegionMaking() override { regions_.spare_ = std::move(scratch_); }
  RegionMaking(const RegionMaking&) = delete;
  RegionMaking& operator=(const RegionMaking&) = delete;

  std::unique_ptr<Resident> advance() override {
    FinderBuild& build = made_->build;
    if (!is_classified_) {
      build.tf_ms = timed([&] { classify(); });
      is_classified_ = true;
      return nullptr;
    }
    if (build.active_macrocells == 0) {
      made_->bottom = buildUnitBox(device_);
      made_->top = buildOneInstance(device_, made_->bottom, 0);
    } else if (!(need_.part == Part::clusters ? mergeBoxes() : extractBoundary())) {
      return nullptr;
    }
    build.total_ms = build.tf_ms + build.tris_ms + build.bvh_ms;
    return std::move(made_);
  }
  std::uint64_t bytes() const override { return made_ != nullptr ? made_->bytes() : 0; }

 private:
  struct Merged {
    std::vector<MacrocellBox> boxes;
    double ms = 0;
  };

  void classify();
  bool mergeBoxes();
  bool extractBoundary();
  std::uint32_t writeFaces();
  std::uint64_t commonBytes() const {
    return made_->states.bytes() + made_->bottom.storage.bytes() + made_->top.storage.bytes();
  }

  ActiveRegions& regions_;
  Device& device_;
  Need need_;
  std::vector<std::shared_ptr<const ResidentMacrocells>> macrocells_;
  std::uint64_t occupied_ = 0;  // at most so many macrocells can be active
  Scratch scratch_;
  std::unique_ptr<ResidentRegion> made_;
  bool is_classified_ = false;
  std::optional<HostWork<Merged>> merging_;
  std::optional<std::uint32_t> faces_;
};

std::unique_ptr<Making> ActiveRegions::makeRegion(const StoredVolume& volume, const Need& need,
                                                  std::vector<std::shared_ptr<const ResidentMacrocells>> macrocells) {
  const glm::ivec3 dims = volume.file->info().level(need.level, need.form).dims;
  return std::make_unique<RegionMaking>(*this, dims, need, std::move(macrocells));
}

void ActiveRegions::RegionMaking::classify() {
  const std::uint64_t macrocells = macrocellCount(made_->macrocell_dims);
  reserve(device_, scratch_.classified, macrocells, BufferUse::readback);
  reserve(device_, scratch_.counter, sizeof(std::uint32_t), BufferUse::readback);
  made_->states = Buffer(device_, (macrocells + 3) / 4 * 4, BufferUse::resident);  // the render kernel reads words
  std::vector<glm::vec2> intervals;
  for (const RegionChannel& drawn : need_.region) {
    for (const StoredRange& range : drawn.densities) intervals.emplace_back(range.lo, range.hi);
  }
  const Buffer visible = uploadVector(device_, intervals);
  gpu::ClassifyPush push{};
  std::uint64_t next = visible.address();
  for (std::size_t i = 0; i < need_.region.size(); ++i) {
    const RegionChannel& drawn = need_.region[i];
    push.channels[i] = {.ranges = macrocells_[i]->ranges.address(),
                        .intervals = next,
                        .interval_count = static_cast<gpu::uint>(drawn.densities.size()),
                        .range_mask = drawn.range_mask};
    next += drawn.densities.size() * sizeof(glm::vec2);
  }
  push.states = scratch_.classified.address();
  push.macrocell_count = static_cast<gpu::uint>(macrocells);
  push.channel_count = static_cast<gpu::uint>(need_.region.size());
  const gpu::SurroundPush surround{.states = scratch_.classified.address(),
                                   .surrounded = made_->states.address(),
                                   .active_count = scratch_.counter.address(),
                                   .macrocell_dims = made_->macrocell_dims};
  scratch_.counter.mappedAs<std::uint32_t>()[0] = 0;
  device_.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
    regions_.kernels_.dispatch(commands, RegionKernel::classify, push, made_->macrocell_dims);
    makeVisible(commands);
    regions_.kernels_.dispatch(commands, RegionKernel::surround, surround, made_->macrocell_dims);
    makeVisible(commands);
  });
  made_->build.active_macrocells = scratch_.counter.mappedAs<std::uint32_t>()[0];
}

// True once they are built.
bool ActiveRegions::RegionMaking::mergeBoxes() {
  if (!merging_) {
    const auto states = scratch_.classified.mappedAs<std::uint8_t>().first(macrocellCount(made_->macrocell_dims));
    merging_.emplace([states = std::vector<std::uint8_t>(states.begin(), states.end()), dims = made_->macrocell_dims] {
      Merged merged;
      merged.ms = timed([&] { merged.boxes = mergeMacrocells(states, dims); });
      return merged;
    });
  }
  if (!merging_->isReady()) return false;
  const Merged merged = merging_->take();
  FinderBuild& build = made_->build;
  build.tris_ms = merged.ms;
  build.primitives = merged.boxes.size();
  build.bvh_ms = timed([&] {
    const auto side = static_cast<float>(need_.macrocell_voxels);
    const glm::vec3 slack(kSlackShare * side);
    std::vector<glm::vec3> corners;
    const Buffer enlarged(device_, merged.boxes.size() * sizeof(VkAabbPositionsKHR), BufferUse::instances);
    const auto boxes = enlarged.mappedAs<VkAabbPositionsKHR>();
    for (std::size_t i = 0; i < merged.boxes.size(); ++i) {
      corners.push_back(side * glm::vec3(merged.boxes[i].lo));
      corners.push_back(side * glm::vec3(merged.boxes[i].hi));
      const glm::vec3 lo = corners[2 * i] - slack;
      const glm::vec3 hi = corners[2 * i + 1] + slack;
      boxes[i] = {.minX = lo.x, .minY = lo.y, .minZ = lo.z, .maxX = hi.x, .maxY = hi.y, .maxZ = hi.z};
    }
    made_->boxes = uploadVector(device_, corners);
    made_->bottom = buildBoxes(device_, enlarged, static_cast<std::uint32_t>(build.primitives));
    made_->top = buildOneInstance(device_, made_->bottom);
  });
  build.bytes = commonBytes() + made_->boxes.bytes();
  return true;
}

// Returns how many there are, of which those that there was room for are written.
std::uint32_t ActiveRegions::RegionMaking::writeFaces() {
  const auto side = static_cast<float>(need_.macrocell_voxels);
  const glm::ivec3 dims = made_->macrocell_dims;
  const gpu::BoundaryPush push{.states = scratch_.classified.address(),
                               .vertices = scratch_.vertices.address(),
                               .face_count = scratch_.counter.address(),
                               .capacity = static_cast<gpu::uint>(scratch_.vertices.bytes() / kFaceBytes),
                               .macrocell_dims = dims,
                               .macrocell_voxels = side,
                               .slack = kSlackShare * side};
  scratch_.counter.mappedAs<std::uint32_t>()[0] = 0;
  RegionKernels& kernels = regions_.kernels_;
  device_.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
    kernels.dispatch(commands, RegionKernel::faces_x, push, dims + glm::ivec3(1, 0, 0));
    kernels.dispatch(commands, RegionKernel::faces_y, push, dims + glm::ivec3(0, 1, 0));
    kernels.dispatch(commands, RegionKernel::faces_z, push, dims + glm::ivec3(0, 0, 1));
    makeVisible(commands);
  });
  return scratch_.counter.mappedAs<std::uint32_t>()[0];
}

// True once they are built.
bool ActiveRegions::RegionMaking::extractBoundary() {
  FinderBuild& build = made_->build;
  if (!faces_) {
    build.tris_ms = timed([&] {
      const std::uint64_t most = 6 * occupied_;
      reserve(device_, scratch_.vertices, std::min(most * kFaceBytes, kPreallocatedBytes), BufferUse::geometry);
      faces_ = writeFaces();
      if (*faces_ * kFaceBytes > scratch_.vertices.bytes()) {
        scratch_.vertices = Buffer(device_, *faces_ * kFaceBytes, BufferUse::geometry);
        faces_ = writeFaces();
      }
    });
    return false;
  }
  build.primitives = std::uint64_t{2} * *faces_;
  build.bvh_ms = timed([&] {
    made_->bottom = buildTriangles(device_, scratch_.vertices, 2 * *faces_);
    made_->top = buildOneInstance(device_, made_->bottom);
  });
  build.bytes = commonBytes() + scratch_.vertices.bytes();
  return true;
}

}  // namespace blockwalk
