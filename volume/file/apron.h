// SPDX-License-Identifier: Apache-2.0
// One channel of a level with an interpolation apron: every subblock carries its apron around it, so that
// interpolating anywhere inside it reads one run of memory. What the field is outside stored voxels is
// docs/integration.md.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "volume/file/file.h"

namespace blockwalk {

// The blocks and subblocks where the trilinear field of some channel is not empty everywhere: those stored in the file,
// and those whose apron reaches a non-empty voxel of a neighbour. They are the same for every channel of a level.
// Voxels that are empty have the channel's empty value here, NaN and infinite ones too; voxels outside the level repeat
// the nearest inside.
//
// Memory: the records of a window, of the blocks that touch it, and a bounded cache of blocks. `file` must outlive it.
// Throws what VolumeFile throws.
class ApronLevel {
 public:
  // Reads records only. The cache holds so many bytes, and what one block takes at least.
  ApronLevel(const VolumeFile& file, int level, int channel, Form form = Form::values,
             std::uint64_t cache_bytes = std::uint64_t{256} << 20, const BlockWindow& window = {});
  // Another channel of the same level.
  ApronLevel(const ApronLevel& found, int channel)
      : ApronLevel(found.file_, found.level_, channel, found.form_, found.cache_bytes_, found.window_) {}

  // The same for another thread: it shares the records, and has a cache of its own.
  std::unique_ptr<ApronLevel> another(std::uint64_t cache_bytes) const;

  // What VolumeFile::readApronLevel() says. Whoever has made use of the subblocks' ranges may take them out first.
  const Level& records() const { return structure_->records; }
  std::shared_ptr<const Level> shareRecords() const { return {structure_, &structure_->records}; }
  std::vector<Subblock> takeRanges() { return std::exchange(structure_->records.subblocks, {}); }

  // Blocks that touch the window, whose records are kept too.
  std::size_t aroundCount() const { return structure_->around.size(); }

  // Voxels of a subblock: (subblock_side + 2)^3, x fastest, beginning one voxel below its first.
  std::uint64_t subblockVoxels() const;
  std::uint64_t subblockBytes() const;

  // Gives back what is cached of blocks.
  void dropCache();

  // Writes the voxels of a block's subblocks, one after the other: subblock_count * subblockBytes() bytes. Reads the
  // stored blocks that these touch, those that it read last but once.
  void readBlock(std::size_t block, std::span<std::byte> out);

 private:
  struct CachedBlock {
    std::vector<std::byte> voxels;
    std::list<std::uint64_t>::iterator age;
  };

  struct Structure {
    Level records;
    std::vector<Block> around;  // that touch the window, in Morton order
  };

  ApronLevel(const VolumeFile& file, int level, int channel, Form form, std::uint64_t cache_bytes,
             const BlockWindow& window, std::shared_ptr<Structure> structure);
  static std::shared_ptr<Structure> readStructure(const VolumeFile& file, int level, int channel, Form form,
                                                  const BlockWindow& window);
  const Block* find(glm::ivec3 origin) const;
  const std::vector<std::byte>& stored(const Block& block);
  void findSources(glm::ivec3 origin);

  const VolumeFile& file_;
  int level_;
  int channel_;
  Form form_;
  BlockWindow window_;
  std::shared_ptr<Structure> structure_;
  std::unordered_map<std::uint64_t, CachedBlock> cache_;  // by Block::first_stored
  std::list<std::uint64_t> ages_;                         // most recent first
  std::uint64_t cache_bytes_;
  std::uint64_t cached_bytes_ = 0;
  // Voxels of each subblock of the block at hand and of those around them, x fastest; null where none are stored.
  std::vector<const std::byte*> sources_;
};

}  // namespace blockwalk
