// SPDX-License-Identifier: Apache-2.0
// A channel of a level as the file has it and as the kernel reads it: records, and voxels of whole blocks as they lie
// on the device, with their aprons where the filter needs them. Of the host alone.
#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "renderer/plan/need.h"
#include "volume/file/apron.h"

namespace blockwalk {

class BlockReader {
 public:
  // Reads records only. Throws what VolumeFile throws. `cache_bytes`: of blocks that aprons are made from.
  BlockReader(std::shared_ptr<const VolumeFile> file, const Need& need, std::uint64_t cache_bytes);

  // The same for another thread, with a cache of its own.
  std::unique_ptr<BlockReader> another(std::uint64_t cache_bytes) const;

  // Without the ranges of its subblocks, which whoever opened it may take once.
  const std::shared_ptr<const Level>& records() const { return records_; }
  std::vector<Subblock> takeRanges() { return std::exchange(ranges_, {}); }
  std::uint64_t blockBytes(std::size_t block) const { return records_->blocks[block].subblock_count * subblock_bytes_; }
  // Of the records of blocks around the window, of which aprons are made.
  std::uint64_t aroundBytes() const { return apron_ == nullptr ? 0 : apron_->aroundCount() * sizeof(Block); }
  int exponent() const { return exponent_; }  // of densities on the device (renderer/plan/density_scale.h)

  // Gives back what is kept of neighbours that aprons are made from.
  void dropCache();

  // Says that read() of these comes next. Throws as that does.
  void expect(std::span<const std::uint32_t> blocks) const;
  // Of `count` blocks from `first` on, one after the other: `out` has just their bytes. From one thread at a time.
  void read(std::size_t first, std::size_t count, std::span<std::byte> out);

 private:
  BlockReader(const BlockReader& other, std::uint64_t cache_bytes);

  std::shared_ptr<const VolumeFile> file_;
  Need need_;
  std::uint64_t subblock_bytes_;
  int exponent_;
  std::unique_ptr<ApronLevel> apron_;
  std::shared_ptr<const Level> records_;
  std::vector<Subblock> ranges_;
  std::vector<std::byte> plain_;
};

}  // namespace blockwalk
