// SPDX-License-Identifier: Apache-2.0
#include "renderer/find/active_region.h"

#include <algorithm>
#include <array>
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

// Wall time of a stage, waiting for the device included.
template <typename Work>
double timed(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

// Ranges do not change: once a level, macrocell size and channel.
class ActiveRegions::MacrocellMaking final : public Making {
 public:
  MacrocellMaking(ActiveRegions& regions, const VolumeInfo& info, const Need& need,
                  std::shared_ptr<const ResidentBlocks> blocks, std::shared_ptr<const ResidentMasks> masks,
                  std::shared_ptr<const ResidentGrid> grid)
      : regions_(regions),
        dims_(latticeDims(info.level(need.level, need.form).dims, need.macrocell_voxels)),
        slabs_(dims_, regions.piece_macrocells_),
        blocks_(std::move(blocks)),
        masks_(std::move(masks)),
        grid_(std::move(grid)),
        counter_(regions.device_, sizeof(std::uint32_t), BufferUse::readback),
        made_(std::make_unique<ResidentMacrocells>()) {
    made_->ranges = Buffer(regions.device_, cellCount(dims_) * sizeof(gpu::GpuSubblock), BufferUse::resident);
    counter_.mappedAs<std::uint32_t>()[0] = 0;
    push_ = {.blocks = blocks_->records.address(),
             .subblocks = masks_->records.address(),
             .grid_tiles = grid_->tiles.address(),
             .grid_blocks = grid_->blocks.address(),
             .ranges = made_->ranges.address(),
             .occupied = counter_.address(),
             .tile_dims = grid_->tile_dims,
             .macrocell_dims = dims_,
             .macrocell_voxels = need.macrocell_voxels,
             .subblock_side = info.subblock_side,
             .block_side = info.block_side};
  }

  std::unique_ptr<Resident> advance() override {
    regions_.kernels_.run(RegionKernel::macrocells, push_, slabs_.next());
    if (!slabs_.isDone()) return nullptr;
    made_->occupied = counter_.mappedAs<std::uint32_t>()[0];
    return std::move(made_);
  }
  std::uint64_t bytes() const override { return made_ != nullptr ? made_->bytes() : 0; }

 private:
  ActiveRegions& regions_;
  glm::ivec3 dims_;
  Slabs slabs_;
  std::shared_ptr<const ResidentBlocks> blocks_;
  std::shared_ptr<const ResidentMasks> masks_;
  std::shared_ptr<const ResidentGrid> grid_;
  Buffer counter_;
  std::unique_ptr<ResidentMacrocells> made_;
  gpu::MacrocellPush push_{};
};

std::unique_ptr<Making> ActiveRegions::makeMacrocells(const StoredVolume& volume, const Need& need,
                                                      std::shared_ptr<const ResidentBlocks> blocks,
                                                      std::shared_ptr<const ResidentMasks> masks,
                                                      std::shared_ptr<const ResidentGrid> grid) {
  return std::make_unique<MacrocellMaking>(*this, volume.file->info(), need, std::move(blocks), std::move(masks),
                                           std::move(grid));
}

// Classifies; merges on a thread of the host's, or writes faces: in pieces. Then builds, which is one piece: the driver
// takes a structure whole.
class ActiveRegions::RegionMaking final : public Making {
 public:
  RegionMaking(ActiveRegions& regions, glm::ivec3 level_dims, const Need& need,
               std::vector<std::shared_ptr<const ResidentMacrocells>> macrocells)
      : regions_(regions),
        device_(regions.device_),
        need_(need),
        macrocells_(std::move(macrocells)),
        dims_(latticeDims(level_dims, need.macrocell_voxels)),
        scratch_(std::exchange(regions.spare_, {})),
        made_(std::make_unique<ResidentRegion>()),
        slabs_(slabsOf(dims_)) {
    made_->macrocell_dims = dims_;
    made_->build = {.macrocell_voxels = need.macrocell_voxels, .macrocells = cellCount(dims_)};
    for (const auto& of_channel : macrocells_) occupied_ += of_channel->occupied;
  }
  ~RegionMaking() override { regions_.spare_ = std::move(scratch_); }
  RegionMaking(const RegionMaking&) = delete;
  RegionMaking& operator=(const RegionMaking&) = delete;

  std::unique_ptr<Resident> advance() override {
    FinderBuild& build = made_->build;
    if (stage_ != Stage::shapes) {
      build.tf_ms += timed([&] { stage_ == Stage::classify ? classify() : surround(); });
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

  enum class Stage : std::uint8_t { classify, surround, shapes };

  Slabs slabsOf(glm::ivec3 cells) const { return {cells, regions_.piece_macrocells_}; }
  void prepareClassification();
  void classify();
  void surround();
  bool mergeBoxes();
  bool extractBoundary();
  void beginFaces(std::uint64_t bytes);
  void writeFaces();
  std::uint64_t commonBytes() const {
    return made_->states.bytes() + made_->bottom.storage.bytes() + made_->top.storage.bytes();
  }

  ActiveRegions& regions_;
  Device& device_;
  Need need_;
  std::vector<std::shared_ptr<const ResidentMacrocells>> macrocells_;
  std::uint64_t occupied_ = 0;  // at most so many macrocells can be active
  glm::ivec3 dims_;
  Scratch scratch_;
  std::unique_ptr<ResidentRegion> made_;
  Stage stage_ = Stage::classify;
  Slabs slabs_;     // of the stage
  Buffer visible_;  // densities that can be seen
  gpu::ClassifyPush push_{};
  std::optional<HostWork<Merged>> merging_;
  int axis_ = -1;  // of the faces that are written; 3: they all are
};

std::unique_ptr<Making> ActiveRegions::makeRegion(const StoredVolume& volume, const Need& need,
                                                  std::vector<std::shared_ptr<const ResidentMacrocells>> macrocells) {
  const glm::ivec3 dims = volume.file->info().level(need.level, need.form).dims;
  return std::make_unique<RegionMaking>(*this, dims, need, std::move(macrocells));
}

void ActiveRegions::RegionMaking::prepareClassification() {
  const std::uint64_t macrocells = cellCount(dims_);
  growTo(device_, scratch_.classified, macrocells, BufferUse::readback);
  growTo(device_, scratch_.counter, sizeof(std::uint32_t), BufferUse::readback);
  made_->states = Buffer(device_, (macrocells + 3) / 4 * 4, BufferUse::resident);  // the render kernel reads words
  std::vector<glm::vec2> intervals;
  for (const RegionChannel& drawn : need_.region) {
    for (const StoredRange& range : drawn.densities) intervals.emplace_back(range.lo, range.hi);
  }
  visible_ = uploadVector(device_, intervals);
  std::uint64_t next = visible_.address();
  for (std::size_t i = 0; i < need_.region.size(); ++i) {
    const RegionChannel& drawn = need_.region[i];
    push_.channels[i] = {.ranges = macrocells_[i]->ranges.address(),
                         .intervals = next,
                         .interval_count = static_cast<gpu::uint>(drawn.densities.size()),
                         .range_mask = drawn.range_mask};
    next += drawn.densities.size() * sizeof(glm::vec2);
  }
  push_.states = scratch_.classified.address();
  push_.channel_count = static_cast<gpu::uint>(need_.region.size());
  push_.macrocell_dims = dims_;
  scratch_.counter.mappedAs<std::uint32_t>()[0] = 0;
}

void ActiveRegions::RegionMaking::classify() {
  if (visible_.bytes() == 0) prepareClassification();
  regions_.kernels_.run(RegionKernel::classify, push_, slabs_.next());
  if (!slabs_.isDone()) return;
  slabs_ = slabsOf(dims_);
  stage_ = Stage::surround;
}

void ActiveRegions::RegionMaking::surround() {
  const gpu::SurroundPush push{.states = scratch_.classified.address(),
                               .surrounded = made_->states.address(),
                               .active_count = scratch_.counter.address(),
                               .macrocell_dims = dims_};
  regions_.kernels_.run(RegionKernel::surround, push, slabs_.next());
  if (!slabs_.isDone()) return;
  made_->build.active_macrocells = scratch_.counter.mappedAs<std::uint32_t>()[0];
  stage_ = Stage::shapes;
}

// True once they are built.
bool ActiveRegions::RegionMaking::mergeBoxes() {
  if (!merging_) {
    const auto states = scratch_.classified.mappedAs<std::uint8_t>().first(cellCount(dims_));
    merging_.emplace([states = std::vector<std::uint8_t>(states.begin(), states.end()), dims = dims_] {
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

// Of all that there are those are written that there is room for.
void ActiveRegions::RegionMaking::beginFaces(std::uint64_t bytes) {
  growTo(device_, scratch_.vertices, bytes, BufferUse::geometry);
  scratch_.counter.mappedAs<std::uint32_t>()[0] = 0;
  axis_ = 0;
  slabs_ = slabsOf(dims_ + glm::ivec3(1, 0, 0));
}

void ActiveRegions::RegionMaking::writeFaces() {
  const auto side = static_cast<float>(need_.macrocell_voxels);
  const gpu::BoundaryPush push{.states = scratch_.classified.address(),
                               .vertices = scratch_.vertices.address(),
                               .face_count = scratch_.counter.address(),
                               .capacity = static_cast<gpu::uint>(scratch_.vertices.bytes() / kFaceBytes),
                               .macrocell_dims = dims_,
                               .macrocell_voxels = side,
                               .slack = kSlackShare * side};
  constexpr std::array kKernels{RegionKernel::faces_x, RegionKernel::faces_y, RegionKernel::faces_z};
  regions_.kernels_.run(kKernels.at(static_cast<std::size_t>(axis_)), push, slabs_.next());
  if (!slabs_.isDone() || ++axis_ == 3) return;
  slabs_ = slabsOf(dims_ + glm::ivec3(0, axis_ == 1, axis_ == 2));
}

// True once they are built.
bool ActiveRegions::RegionMaking::extractBoundary() {
  FinderBuild& build = made_->build;
  if (axis_ < 0) beginFaces(std::min(6 * occupied_ * kFaceBytes, kPreallocatedBytes));
  if (axis_ < 3) {
    build.tris_ms += timed([&] { writeFaces(); });
    return false;
  }
  const std::uint64_t faces = scratch_.counter.mappedAs<std::uint32_t>()[0];
  if (faces * kFaceBytes > scratch_.vertices.bytes()) {
    beginFaces(faces * kFaceBytes);
    return false;
  }
  build.primitives = 2 * faces;
  build.bvh_ms = timed([&] {
    made_->bottom = buildTriangles(device_, scratch_.vertices, static_cast<std::uint32_t>(2 * faces));
    made_->top = buildOneInstance(device_, made_->bottom);
  });
  build.bytes = commonBytes() + scratch_.vertices.bytes();
  return true;
}

}  // namespace blockwalk
