// SPDX-License-Identifier: Apache-2.0
// What the finders clusters and boundary look for: the macrocells in which a view may show something, as boxes or as
// the triangles around them (docs/finders.md).
#pragma once

#include "renderer/resident/parts.h"
#include "renderer/vulkan/region_kernels.h"

namespace blockwalk {

// Makes macrocells and regions resident. All but the merging of macrocells into boxes is done by kernels.
class ActiveRegions {
 public:
  // Of macrocells so many are looked at in one piece.
  ActiveRegions(Device& device, std::uint64_t piece_macrocells)
      : device_(device), kernels_(device), piece_macrocells_(piece_macrocells) {}

  // Part::macrocells, of the channel's blocks and masks and the level's grid. It outlives what it makes.
  std::unique_ptr<Making> makeMacrocells(const StoredVolume& volume, const Need& need,
                                         std::shared_ptr<const ResidentBlocks> blocks,
                                         std::shared_ptr<const ResidentMasks> masks,
                                         std::shared_ptr<const ResidentGrid> grid);
  // Part::clusters or boundary, of the macrocells of the need's channels. Where nothing is active no ray meets
  // anything. Throws ViewError where there are more boxes or triangles than a structure of the device holds.
  std::unique_ptr<Making> makeRegion(const StoredVolume& volume, const Need& need,
                                     std::vector<std::shared_ptr<const ResidentMacrocells>> macrocells);

  // Memory that the next region would begin with.
  void dropSpare() { spare_ = {}; }

 private:
  class MacrocellMaking;
  class RegionMaking;
  // What a region is made with. The last one's is kept for the next.
  struct Scratch {
    Buffer classified;  // states before macrocells near active ones are told
    Buffer vertices;    // of the boundary, preallocated
    Buffer counter;
  };

  Device& device_;
  RegionKernels kernels_;
  std::uint64_t piece_macrocells_;
  Scratch spare_;
};

}  // namespace blockwalk
