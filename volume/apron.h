// SPDX-License-Identifier: Apache-2.0
// A level with an interpolation apron: every subblock carries the one-voxel ring around it, so that interpolating
// anywhere inside it reads one run of memory. What the field is outside stored voxels is docs/integration.md.
#pragma once

#include <cstdint>
#include <list>
#include <span>
#include <unordered_map>
#include <vector>

#include "volume/file.h"

namespace blockwalk {

// The blocks and subblocks where a trilinear field is not empty everywhere: those stored in the file, and those whose
// ring reaches a non-empty voxel of a neighbour. Voxels that are empty have the empty value here, NaN and infinite ones
// too; voxels outside the level repeat the nearest inside.
//
// Memory: the records and a bounded cache of blocks. `file` must outlive it. Throws what VolumeFile throws.
class ApronLevel {
 public:
  ApronLevel(const VolumeFile& file, int level);

  // Blocks are final. A subblock's minimum, maximum and mask cover every value that interpolation can give inside it;
  // they are known once readBlock() was called for its block, and so are the block's own.
  const Level& records() const { return records_; }

  // Voxels of a subblock: (subblock_side + 2)^3, x fastest, beginning one voxel below its first.
  std::uint64_t subblockVoxels() const;
  std::uint64_t subblockBytes() const;

  // Writes the voxels of a block's subblocks, one after the other: subblock_count * subblockBytes() bytes.
  void readBlock(std::size_t block, std::span<std::byte> out);

 private:
  struct CachedBlock {
    std::vector<std::byte> voxels;
    std::list<std::size_t>::iterator age;
  };

  void findSubblocks();
  const std::vector<std::byte>& stored(std::size_t block);
  void gather(glm::ivec3 origin, std::size_t around);
  void repeatEdges(glm::ivec3 first_voxel);
  void describeSubblock(const std::byte* voxels, Subblock& subblock) const;

  const VolumeFile& file_;
  int level_;
  Level source_;                                                  // as the file stores it
  std::unordered_map<std::uint64_t, std::size_t> source_blocks_;  // Morton code to index
  Level records_;
  std::unordered_map<std::size_t, CachedBlock> cache_;
  std::list<std::size_t> ages_;  // most recent first
  std::uint64_t cached_bytes_ = 0;
  std::vector<std::byte> dense_;  // a block and its ring
};

}  // namespace blockwalk
