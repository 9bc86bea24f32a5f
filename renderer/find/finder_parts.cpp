// SPDX-License-Identifier: Apache-2.0
#include "renderer/find/finder_parts.h"

#include "renderer/find/block_grid.h"
#include "renderer/find/octree.h"
#include "renderer/resident/at_once.h"
#include "renderer/resident/records.h"
#include "renderer/resident/upload.h"
#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::uint8_t kAllBins = 0xff;

class BringGrid {
 public:
  BringGrid(Device& device, BlockGrid built)
      : built_(std::move(built)),
        tiles_(uploadOf(device, std::span<const std::uint32_t>(built_.tiles))),
        blocks_(uploadOf(device, std::span<const std::uint32_t>(built_.blocks))) {}
  BringGrid(const BringGrid&) = delete;
  BringGrid& operator=(const BringGrid&) = delete;

  std::unique_ptr<Resident> advance() {
    if (!has_tiles_) {
      has_tiles_ = !tiles_.advance();
      if (!has_tiles_ || built_.blocks.size() * sizeof(std::uint32_t) > kUploadPiece) return nullptr;
    }
    if (blocks_.advance()) return nullptr;
    auto made = std::make_unique<ResidentGrid>();
    made->tile_dims = built_.tile_dims;
    made->tiles = tiles_.take();
    made->blocks = blocks_.take();
    return made;
  }
  std::uint64_t bytes() const { return tiles_.bytes() + blocks_.bytes(); }

 private:
  BlockGrid built_;
  Upload tiles_;
  Upload blocks_;
  bool has_tiles_ = false;
};

class BringOctree {
 public:
  BringOctree(Device& device, Octree built)
      : built_(std::move(built)), nodes_(uploadOf(device, std::span<const gpu::OctreeNode>(built_.nodes))) {}
  BringOctree(const BringOctree&) = delete;
  BringOctree& operator=(const BringOctree&) = delete;

  std::unique_ptr<Resident> advance() {
    if (nodes_.advance()) return nullptr;
    auto made = std::make_unique<ResidentOctree>();
    made->depth = built_.depth;
    made->nodes = nodes_.take();
    return made;
  }
  std::uint64_t bytes() const { return nodes_.bytes(); }

 private:
  Octree built_;
  Upload nodes_;
};

// One instance a block over one shared unit box (Derin et al. 2021, 2.1): block i is instance i in the level's index
// space, masked by its range mask where that speaks for all.
AccelerationStructure buildBlockInstances(Device& device, const AccelerationStructure& unit_box, const Level& level,
                                          int block_voxels, bool masked) {
  BLOCKWALK_CHECK(level.blocks.size(), <=, device.maxInstances());
  const Buffer instances(device, level.blocks.size() * sizeof(VkAccelerationStructureInstanceKHR),
                         BufferUse::instances);
  const auto records = instances.mappedAs<VkAccelerationStructureInstanceKHR>();
  const std::uint64_t box = addressOf(device, unit_box);
  const auto side = static_cast<float>(block_voxels);
  for (std::size_t i = 0; i < level.blocks.size(); ++i) {
    const glm::vec3 corner = level.blocks[i].origin * block_voxels;
    records[i] = {.transform = {{{side, 0, 0, corner.x}, {0, side, 0, corner.y}, {0, 0, side, corner.z}}},
                  .instanceCustomIndex = 0,
                  .mask = masked ? level.blocks[i].range_mask : std::uint8_t{0xff},
                  .instanceShaderBindingTableRecordOffset = 0,
                  .flags = 0,
                  .accelerationStructureReference = box};
  }
  return buildInstances(device, instances, static_cast<std::uint32_t>(level.blocks.size()));
}

}  // namespace

std::unique_ptr<Making> makeGrid(Device& device, const StoredVolume& volume,
                                 std::shared_ptr<const ResidentVoxels> voxels) {
  return std::make_unique<BuiltOnHost<BlockGrid, BringGrid>>(
      device, [records = voxels->records, block_voxels = volume.file->info().blockVoxels()] {
        return buildBlockGrid(*records, block_voxels);
      });
}

std::unique_ptr<Making> makeOctree(Device& device, const StoredVolume& volume, const Need& need,
                                   std::shared_ptr<const ResidentVoxels> voxels) {
  return std::make_unique<BuiltOnHost<Octree, BringOctree>>(
      device, [records = voxels->records, ranges = voxels->ranges, file = volume.file, need] {
        // Of several channels nobody looks at the bins.
        Need of_channel = need;
        of_channel.channel = 0;
        std::vector<OctreeLeaf> leaves =
            need.of_blocks ? blockLeaves(*records)
                           : subblockLeaves(*records, *rangesOf(*file, of_channel, ranges), file->info().block_side);
        if (file->info().channels.size() > 1) {
          for (OctreeLeaf& leaf : leaves) leaf.range_mask = kAllBins;
        }
        return buildOctree(std::move(leaves));
      });
}

std::unique_ptr<Making> makeInstances(Device& device, const StoredVolume& volume, const AccelerationStructure& unit_box,
                                      std::shared_ptr<const ResidentVoxels> voxels) {
  return makeAtOnce([&device, &unit_box, voxels = std::move(voxels), file = volume.file] {
    const bool alone = file->info().channels.size() == 1;
    auto made = std::make_unique<ResidentInstances>();
    made->top = buildBlockInstances(device, unit_box, *voxels->records, file->info().blockVoxels(), alone);
    return made;
  });
}

}  // namespace blockwalk
