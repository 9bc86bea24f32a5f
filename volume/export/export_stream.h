// SPDX-License-Identifier: Apache-2.0
// An export from front to back, for those who have no file to write: the same bytes as exportVolume() writes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "volume/export/export.h"

namespace blockwalk {

class RowReader;
struct ExportJob;
struct StoredBlocks;

// Memory: the blocks of the level without their subblocks, and 16 MiB or one row a channel. Not thread-safe.
class ExportStream {
 public:
  // NRRD, npy or raw. Reads no voxel yet. Throws ExportError for options that the volume has not; `file` must outlive
  // it.
  ExportStream(const VolumeFile& file, const ExportOptions& options);
  ~ExportStream();
  ExportStream(const ExportStream&) = delete;
  ExportStream& operator=(const ExportStream&) = delete;

  // Of the level, where somebody has them; else the first voxels wait until they are read.
  void useBlocks(std::shared_ptr<const StoredBlocks> blocks) { blocks_ = std::move(blocks); }
  std::uint64_t bytes() const;
  // Sides of the box, channels, and the type of a voxel as `blockwalk import --type` spells it.
  glm::ivec3 dims() const;
  std::size_t channels() const;
  std::string type() const;
  // The next bytes, a MiB or one row; none at the end. Throws what VolumeFile throws.
  std::vector<std::byte> next();

 private:
  std::unique_ptr<const ExportJob> job_;
  std::string header_;
  std::shared_ptr<const StoredBlocks> blocks_;
  std::unique_ptr<RowReader> reader_;
  bool has_begun_ = false;
  std::size_t channel_ = 0;  // of the next row, as are z and y
  int z_ = 0;
  int y_ = 0;
};

}  // namespace blockwalk
