// SPDX-License-Identifier: Apache-2.0
// The metadata.json of a PRISM folder (Reese 2019): bricks of several sizes that make up a volume.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

constexpr int kMaxBrickSide = 512;
constexpr std::uint64_t kMaxPrismTextBytes = std::uint64_t{16} << 20;
constexpr std::size_t kMaxBricks = std::size_t{1} << 17;

// A cube of voxels, zero where the volume ends before it, in a file of its own: hierarchical Z order or x fastest.
struct Brick {
  std::string file;
  glm::ivec3 position{0};  // of its first voxel, a multiple of `side`
  int side = 0;            // voxels, a power of two up to kMaxBrickSide
  bool is_hz = true;
  std::uint64_t code = 0;  // Morton code of `position`: its voxels have the codes from here on

  std::uint64_t voxels() const {
    return static_cast<std::uint64_t>(side) * static_cast<std::uint64_t>(side) * static_cast<std::uint64_t>(side);
  }
  // A code at or above the brick's own.
  bool holds(std::uint64_t voxel_code) const { return voxel_code - code < voxels(); }
};

struct PrismMetadata {
  int bytes_per_voxel = 1;  // 1 or 2
  bool big_endian = true;
  glm::ivec3 dims{0};         // voxels: what is said to be the true size, else up to where the bricks end
  bool dims_said = false;     // by "trueSize", which this project writes; the format itself has no word for it
  glm::dvec3 scale{1};        // of a voxel
  std::vector<Brick> bricks;  // by code; they do not overlap
  int least_side = 0;         // of a brick

  // The brick that holds this voxel, nullptr in a gap.
  const Brick* brickAt(glm::ivec3 voxel) const;
};

// Throws DataError naming the field and the bound, also for bricks that overlap or lie outside `globalSize`. Opens no
// brick. "octree", "minLevel" and "maxLevel" are passed over: an octree says -1 where it has no brick of its own, which
// is not what is empty.
PrismMetadata readPrismMetadata(const InputFile& file);

}  // namespace blockwalk
