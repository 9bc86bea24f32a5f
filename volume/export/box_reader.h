// SPDX-License-Identifier: Apache-2.0
// Dense voxels of a level, a box at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "volume/file/file.h"
#include "volume/voxel_box.h"

namespace blockwalk {

// Which blocks of a level there are, and where in it; plain data that several readers may share.
struct StoredBlocks {
  std::vector<Block> blocks;         // in Morton order
  std::vector<std::uint64_t> codes;  // theirs
  std::uint64_t bytes() const { return blocks.size() * (sizeof(Block) + sizeof(std::uint64_t)); }
};
// Decodes all records of the level, of which the subblocks' go again. Throws what VolumeFile throws.
std::shared_ptr<const StoredBlocks> readStoredBlocks(const VolumeFile& file, int level, Form form = Form::values);

// Memory: the blocks of the level, without the records of their subblocks, and one block's voxels. `file` must outlive
// it. Throws what VolumeFile throws.
class BoxReader {
 public:
  // `blocks` of that level, in that form, of a file of the same content; read where there are none.
  BoxReader(const VolumeFile& file, int level, std::shared_ptr<const StoredBlocks> blocks = nullptr,
            Form form = Form::values);

  // Voxels of one channel, x fastest: voxels() * voxelBytes(). What is not stored has the channel's empty value. The
  // box lies inside the level; each block that it touches is read once.
  void read(int channel, const VoxelBox& box, std::span<std::byte> out);

  // Any voxel of the box, inside the level, may be stored.
  bool isStored(const VoxelBox& box) const;
  const std::vector<Block>& blocks() const { return stored_->blocks; }

 private:
  const Block* find(glm::ivec3 origin) const;
  void copyBlock(int channel, const Block& block, const VoxelBox& box, std::span<std::byte> out);

  const VolumeFile& file_;
  int level_number_;
  Form form_;
  std::size_t voxel_bytes_;
  std::shared_ptr<const StoredBlocks> stored_;
  std::vector<std::byte> block_;
};

}  // namespace blockwalk
