// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/parts.h"

#include "renderer/resident/pages.h"

namespace blockwalk {

ResidentVoxels::ResidentVoxels() = default;
ResidentVoxels::~ResidentVoxels() = default;

std::uint64_t ResidentVoxels::bytes() const {
  std::uint64_t sum = on_host.bytes() + ranges_on_host.bytes() + (pages != nullptr ? pages->bytes() : 0);
  for (const Buffer& chunk : chunks) sum += chunk.bytes();
  return sum;
}

ResidentBlocks::~ResidentBlocks() {
  if (voxels != nullptr && voxels->pages != nullptr) voxels->pages->leave(this);
}

ResidentQuarters::~ResidentQuarters() {
  if (blocks != nullptr && blocks->voxels->pages != nullptr) blocks->voxels->pages->leave(this);
}

}  // namespace blockwalk
