// SPDX-License-Identifier: Apache-2.0
// What the finders clusters and boundary look for: the macrocells in which a view may show something, as boxes or as
// the triangles around them (docs/finders.md).
#pragma once

#include <optional>
#include <vector>

#include "renderer/find/acceleration.h"
#include "renderer/plan/plan.h"
#include "renderer/resident/resident_volume.h"
#include "renderer/vulkan/region_kernels.h"

namespace blockwalk {

// A channel drawn, and what can be seen of it.
struct RegionChannel {
  std::size_t channel = 0;  // of the volume
  std::uint8_t range_mask = 0;
  std::vector<StoredRange> densities;  // visibleDensities()
  bool operator==(const RegionChannel&) const = default;
};

// All that a region depends on. Colours, cameras and everything else change without it.
struct RegionKey {
  std::uint64_t volume = 0;  // VulkanVolume::serial()
  int level = 0;
  Form form = Form::values;
  bool apron = false;
  int cell_voxels = 0;
  std::vector<RegionChannel> channels;
  bool operator==(const RegionKey&) const = default;
};

// Macrocells of a level's box.
glm::ivec3 macrocellDims(glm::ivec3 level_dims, int cell_voxels);

struct ActiveRegion {
  RegionKey key;
  glm::ivec3 cell_dims{0};
  std::uint64_t occupied = 0;  // at most so many cells can be active
  Buffer states;               // uint8_t[], x fastest
  Buffer boxes;                // clusters: vec3[2][], voxels
  AccelerationStructure bottom;
  AccelerationStructure top;
  FinderBuild build;
};

// Regions on the device: of each of the two finders the last that was asked for, built anew when its key changes. All
// but the merging of cells into boxes is done by kernels.
class ActiveRegions {
 public:
  explicit ActiveRegions(Device& device) : device_(device), kernels_(device) {}

  // `level` is the key's, with its channels resident. Where nothing is active no ray meets anything.
  const ActiveRegion& clusters(VulkanVolume& volume, ResidentLevel& level, RegionKey key);
  const ActiveRegion& boundary(VulkanVolume& volume, ResidentLevel& level, RegionKey key);

  // The next that is asked for is built anew.
  void forget();

 private:
  using Build = void (ActiveRegions::*)(ActiveRegion& region);

  const ActiveRegion& rebuilt(ActiveRegion& region, VulkanVolume& volume, ResidentLevel& level, RegionKey key,
                              Build build);
  void makeMacrocells(VulkanVolume& volume, ResidentLevel& level, const RegionKey& key);
  void classify(ActiveRegion& region, const ResidentLevel& level);
  void mergeBoxes(ActiveRegion& region);
  void extractBoundary(ActiveRegion& region);
  std::uint32_t writeFaces(const ActiveRegion& region);

  Device& device_;
  RegionKernels kernels_;
  ActiveRegion clusters_;
  ActiveRegion boundary_;
  Buffer classified_;  // states before cells near active ones are told
  Buffer vertices_;    // of the boundary, preallocated
  Buffer counter_;
};

}  // namespace blockwalk
