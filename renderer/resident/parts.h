// SPDX-License-Identifier: Apache-2.0
// The kinds of what is resident (Part), as those that draw read them.
#pragma once

#include "renderer/resident/pins.h"
#include "renderer/vulkan/acceleration.h"
#include "renderer/vulkan/buffer.h"
#include "renderer/vulkan/host_share.h"
#include "view/frame.h"
#include "volume/volume.h"

namespace blockwalk {

class PagedVoxels;

// Of a channel of a level: all voxels, block after block; or those that are wanted (pages.h).
struct ResidentVoxels final : Resident {
  ResidentVoxels();
  ~ResidentVoxels() override;
  std::vector<Buffer> chunks;                  // no block crosses from one to the next
  std::vector<std::uint64_t> block_addresses;  // on the device; 0 of those that come and go
  std::unique_ptr<PagedVoxels> pages;          // that do; null where all are there
  std::shared_ptr<const Level> records;        // on the host, without the ranges of subblocks
  // Those, with the apron where there is one, until the device has them.
  mutable std::shared_ptr<const std::vector<Subblock>> ranges;
  HostShare on_host;                 // what all those take, but for the ranges
  mutable HostShare ranges_on_host;  // what they take
  int exponent = 0;                  // of densities on the device (renderer/plan/density_scale.h)

  std::uint64_t bytes() const override;
};

struct ResidentBlocks final : Resident {
  ResidentBlocks() = default;
  ~ResidentBlocks() override;
  Buffer records;                                // gpu::GpuBlock[]
  std::shared_ptr<const ResidentVoxels> voxels;  // whose addresses they hold
  std::uint64_t bytes() const override { return records.bytes(); }
};

struct ResidentMasks final : Resident {
  Buffer records;  // gpu::GpuSubblock[]
  std::uint32_t count = 0;
  std::uint64_t bytes() const override { return records.bytes(); }
};

// Which quarters of a channel's subblocks may show something in a range (shaders/visible_quarters.comp).
struct ResidentQuarters final : Resident {
  ResidentQuarters() = default;
  ~ResidentQuarters() override;
  Buffer quarters;  // uint[2][], one a subblock
  // What they are found from, again where pages come in.
  StoredRange range;
  std::shared_ptr<const ResidentBlocks> blocks;
  std::shared_ptr<const ResidentMasks> masks;
  std::uint64_t bytes() const override { return quarters.bytes(); }
};

// Of a paged level: uint[], for each block that of a coarser level which covers it, or kNone.
struct ResidentAncestors final : Resident {
  Buffer blocks;
  std::uint64_t bytes() const override { return blocks.bytes(); }
};

// Voxels of one subblock that is empty everywhere.
struct ResidentEmpty final : Resident {
  Buffer voxels;
  std::uint64_t bytes() const override { return voxels.bytes(); }
};

// A channel's baked transfer function (renderer/plan/transfer_table.h).
struct ResidentTable final : Resident {
  Buffer entries;
  Buffer integrals;  // only for pre-integration
  float scale = 1;
  float first = 0;
  float last = 0;
  std::uint64_t bytes() const override { return entries.bytes() + integrals.bytes(); }
};

struct ResidentGrid final : Resident {
  glm::ivec3 tile_dims{0};
  Buffer tiles;
  Buffer blocks;
  std::uint64_t bytes() const override { return tiles.bytes() + blocks.bytes(); }
};

struct ResidentOctree final : Resident {
  int depth = 1;
  Buffer nodes;
  std::uint64_t bytes() const override { return nodes.bytes(); }
};

struct ResidentInstances final : Resident {
  AccelerationStructure top;
  std::uint64_t bytes() const override { return top.storage.bytes(); }
};

// Ranges of a channel in macrocells (renderer/find/active_region.h).
struct ResidentMacrocells final : Resident {
  Buffer ranges;  // gpu::GpuSubblock[], x fastest
  std::uint32_t occupied = 0;
  std::uint64_t bytes() const override { return ranges.bytes(); }
};

// Clusters or boundary: the macrocells in which a view may show something.
struct ResidentRegion final : Resident {
  glm::ivec3 macrocell_dims{0};
  Buffer states;  // uint8_t[], x fastest
  Buffer boxes;   // clusters: vec3[2][], voxels
  AccelerationStructure bottom;
  AccelerationStructure top;
  FinderBuild build;
  std::uint64_t bytes() const override {
    return states.bytes() + boxes.bytes() + bottom.storage.bytes() + top.storage.bytes();
  }
};

}  // namespace blockwalk
