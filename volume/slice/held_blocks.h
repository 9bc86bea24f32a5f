// SPDX-License-Identifier: Apache-2.0
// Voxels of one channel of a level wherever they are asked for, of which the blocks used last stay.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <list>
#include <unordered_map>
#include <vector>

#include "volume/export/box_reader.h"

namespace blockwalk {

class HeldBlocks {
 public:
  // `reader` must outlive it. At least one block is held, whatever `most_bytes` is.
  HeldBlocks(const VolumeFile& file, BoxReader& reader, glm::ivec3 level_dims, int channel, std::uint64_t most_bytes);

  // The bytes of a voxel inside the level, until the next call. Throws what VolumeFile throws.
  const std::byte* voxel(glm::ivec3 place) {
    const glm::ivec3 block = place / side_;
    if (newest_ == nullptr || block != newest_->block) newest_ = &hold(block);
    const glm::ivec3 inside = place - block * side_;
    const glm::ivec3 dims = newest_->dims;
    const auto index =
        (static_cast<std::size_t>(inside.z) * static_cast<std::size_t>(dims.y) + static_cast<std::size_t>(inside.y)) *
            static_cast<std::size_t>(dims.x) +
        static_cast<std::size_t>(inside.x);
    return newest_->voxels.data() + index * voxel_bytes_;
  }
  // Blocks that were read or found empty so far.
  std::uint64_t held() const { return misses_; }

 private:
  struct Held {
    glm::ivec3 block{-1};
    glm::ivec3 dims{0};
    std::vector<std::byte> voxels;
  };
  Held& hold(glm::ivec3 block);

  BoxReader& reader_;
  glm::ivec3 level_dims_;
  int channel_;
  int side_;
  std::size_t voxel_bytes_;
  std::size_t most_;      // blocks
  std::list<Held> held_;  // the newest first
  std::unordered_map<std::uint64_t, std::list<Held>::iterator> places_;
  const Held* newest_ = nullptr;
  std::uint64_t misses_ = 0;
};

}  // namespace blockwalk
