// SPDX-License-Identifier: Apache-2.0
#include "volume/export/brick_partition.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <utility>

#include "volume/error.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

// Side in cells of the largest cube that a cell joins.
int joinedSide(glm::ivec3 cell, glm::ivec3 cells) {
  int side = kGreatestBrick / kLeastBrick;
  while (glm::any(glm::greaterThan((cell / side + 1) * side, cells))) side /= 2;
  return side;
}

class OctreeWriter {
 public:
  // `least`: side of a leaf, voxels.
  OctreeWriter(const std::vector<BrickPlace>& bricks, int least) : least_(least) {
    for (const BrickPlace& brick : bricks) {
      first_.emplace_back(mortonCode(glm::uvec3(brick.position)), first_.size());
    }
    std::ranges::sort(first_);
  }

  // Nodes in Morton order, as children of a node are.
  std::string write(std::uint64_t code, int side) {
    ++nodes_;
    const auto voxels = cellCount(glm::ivec3(side));
    const auto found = std::ranges::lower_bound(first_, std::pair(code, std::size_t{0}));
    if (found == first_.end() || found->first - code >= voxels) return "{\"Value\":-1}";
    if (side == least_) return fmt::format("{{\"Value\":{}}}", found->second);
    std::string children;
    for (std::uint64_t i = 0; i < 8; ++i) {
      if (i > 0) children += ',';
      children += write(code + i * (voxels / 8), side / 2);
    }
    return "{\"Children\":[" + children + "]}";
  }
  std::size_t nodes() const { return nodes_; }

 private:
  int least_;
  std::vector<std::pair<std::uint64_t, std::size_t>> first_;  // code of a brick's first voxel, and its number
  std::size_t nodes_ = 0;
};

std::string tripleText(glm::ivec3 values) { return fmt::format("[{},{},{}]", values.x, values.y, values.z); }

}  // namespace

std::vector<BrickPlace> partitionBricks(glm::ivec3 dims, std::string_view file) {
  const glm::ivec3 cells = latticeDims(dims, kLeastBrick);
  std::vector<BrickPlace> bricks;
  for (int z = 0; z < cells.z; ++z) {
    for (int y = 0; y < cells.y; ++y) {
      for (int x = 0; x < cells.x; ++x) {
        const glm::ivec3 cell(x, y, z);
        const int side = joinedSide(cell, cells);
        if (cell / side * side != cell) continue;
        if (bricks.size() == kMostBricks) {
          failData("{}: {} x {} x {} voxels are more than {} bricks; export a box or a coarser level", file, dims.x,
                   dims.y, dims.z, kMostBricks);
        }
        bricks.push_back({cell * kLeastBrick, side * kLeastBrick});
      }
    }
  }
  return bricks;
}

std::string brickFileName(std::size_t number) { return fmt::format("{}.hz", number); }

std::string brickMetadata(const std::vector<BrickPlace>& bricks, glm::ivec3 dims, const glm::dvec3& scale,
                          int bytes_per_voxel) {
  const int least = std::ranges::min(bricks, {}, &BrickPlace::side).side;
  const int greatest = std::ranges::max(bricks, {}, &BrickPlace::side).side;
  const glm::ivec3 global = latticeDims(dims, least) * least;
  const auto root = std::bit_ceil(static_cast<unsigned>(std::max({global.x, global.y, global.z})));
  OctreeWriter octree(bricks, least);
  const std::string tree = octree.write(0, static_cast<int>(root));
  std::string text = fmt::format(R"({{"minLevel":{},"maxLevel":{},"bricks":[)", least, greatest);
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    text += fmt::format(R"({}{{"filename":"{}","size":{},"position":{}}})", i == 0 ? "" : ",", brickFileName(i),
                        bricks[i].side, tripleText(bricks[i].position));
  }
  return text + fmt::format(R"(],"octree":{},"totalBricks":{},"totalOctnodes":{},"bytesPerPixel":{},)"
                            R"("scale":[{},{},{}],"endianness":"BIG_ENDIAN","globalSize":{},"trueSize":{}}})",
                            tree, bricks.size(), octree.nodes(), bytes_per_voxel, scale.x, scale.y, scale.z,
                            tripleText(global), tripleText(dims));
}

}  // namespace blockwalk
