// SPDX-License-Identifier: Apache-2.0
#include "volume/slice/held_blocks.h"

#include <algorithm>

namespace blockwalk {

HeldBlocks::HeldBlocks(const VolumeFile& file, BoxReader& reader, glm::ivec3 level_dims, int channel,
                       std::uint64_t most_bytes)
    : reader_(reader),
      level_dims_(level_dims),
      channel_(channel),
      side_(file.info().blockVoxels()),
      voxel_bytes_(voxelBytes(file.info().type)) {
  const std::uint64_t block_bytes = cellCount(glm::ivec3(side_)) * voxel_bytes_;
  most_ = static_cast<std::size_t>(std::max<std::uint64_t>(1, most_bytes / block_bytes));
}

HeldBlocks::Held& HeldBlocks::hold(glm::ivec3 block) {
  const std::uint64_t code = mortonCode(glm::uvec3(block));
  if (const auto known = places_.find(code); known != places_.end()) {
    held_.splice(held_.begin(), held_, known->second);
    return held_.front();
  }
  ++misses_;
  if (held_.size() < most_) {
    held_.emplace_front();
  } else {
    places_.erase(mortonCode(glm::uvec3(held_.back().block)));
    held_.splice(held_.begin(), held_, std::prev(held_.end()));
  }
  Held& fresh = held_.front();
  const VoxelBox box{.begin = block * side_, .end = glm::min((block + 1) * side_, level_dims_)};
  fresh.block = block;
  fresh.dims = box.dims();
  fresh.voxels.resize(box.voxels() * voxel_bytes_);
  places_[code] = held_.begin();
  reader_.read(channel_, box, fresh.voxels);
  return fresh;
}

}  // namespace blockwalk
