// SPDX-License-Identifier: Apache-2.0
// The tree of a channel as NanoVDB has trees: which leaves of 8^3 voxels hold something that is not empty, and what is
// in them. Index space is that of the job's box, whose first voxel is (0, 0, 0).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "volume/export/box_reader.h"
#include "volume/export/export_job.h"
#include "volume/formats/nano_layout.h"

namespace blockwalk {

// Voxels; 16^3 leaves are a lower node.
constexpr int kNanoLeafSide = 1 << nano::kNodeVoxelsLog2[2];
constexpr int kNanoLowerSide = 1 << nano::kNodeVoxelsLog2[1];

// Of what is not empty: both corners, with them, and least and greatest value.
struct NanoExtent {
  glm::ivec3 least{INT32_MAX};
  glm::ivec3 greatest{INT32_MIN};
  float value_min = 0;
  float value_max = 0;
  std::uint64_t voxels = 0;

  void add(const NanoExtent& other);
};

struct NanoLower {
  glm::ivec3 cell{0};                      // in cubes of kNanoLowerSide
  std::array<std::uint64_t, 64> leaves{};  // bit (x * 16 + y) * 16 + z
  std::uint64_t first_leaf = 0;
  std::uint32_t leaf_count = 0;
  NanoExtent extent;
};

struct NanoLeaf {
  glm::ivec3 origin{0};
  std::array<std::uint64_t, 8> mask{};                 // bit (x * 8 + y) * 8 + z
  std::array<std::array<std::byte, 4>, 512> values{};  // by the same numbers: floats in data units, or colours
  NanoExtent extent;
};

// Lower nodes that may hold something, by the blocks that are stored: in the order of the file, with all leaves that
// may be there. Throws DataError for more than kMostNanoLowers.
constexpr std::size_t kMostNanoLowers = std::size_t{1} << 20;
std::vector<NanoLower> nanoCandidates(const ExportJob& job);

// Where the root has the node: keys ascend.
std::uint64_t nanoRootKey(glm::ivec3 lower_cell);
// The number of the node in its upper one.
std::uint32_t nanoEntry(glm::ivec3 lower_cell);

// Reads one channel. Memory: a cube of kNanoLowerSide, and what BoxReader takes.
class NanoLeafReader {
 public:
  NanoLeafReader(const ExportJob& job, std::size_t channel);

  // What an empty voxel has, as a value of a leaf.
  std::array<std::byte, 4> background() const { return background_; }
  // visit(leaf) for those of the node's leaves that hold something, in ascending order.
  void read(const NanoLower& node, const std::function<void(const NanoLeaf&)>& visit);

 private:
  bool fill(glm::ivec3 origin, const VoxelBox& box, NanoLeaf& leaf) const;
  std::array<std::byte, 4> valueOf(float stored) const;

  const ExportJob& job_;
  std::size_t channel_;
  BoxReader reader_;
  std::array<std::byte, 4> background_{};
  std::vector<std::byte> voxels_;
};

}  // namespace blockwalk
