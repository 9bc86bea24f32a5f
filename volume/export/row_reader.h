// SPDX-License-Identifier: Apache-2.0
// Voxels of a box in their own order, for formats and sockets that are written from front to back.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "volume/export/box_reader.h"
#include "volume/export/export_job.h"

namespace blockwalk {

constexpr std::size_t kRowReaderBytes = std::size_t{64} << 20;

// Memory: besides a BoxReader's, `memory_bytes` or one row a channel, whichever is more. Each block is unpacked once
// where slices as thick as a block fit; of larger ones, once for each part of its thickness that fits.
class RowReader {
 public:
  // `blocks` as BoxReader takes them.
  RowReader(const ExportJob& job, std::size_t memory_bytes, std::shared_ptr<const StoredBlocks> blocks = nullptr);

  // Rows that one call may ask for from here on without reading more, at least 1.
  int rowsAt(int y) const;
  // Rows [y, y + count) of slice z of the job's channel number `channel`, x fastest, little endian, signed where the
  // job says so; y and z are counted from the box's first voxel, and count <= rowsAt(y). Valid until the next call for
  // this channel.
  std::span<const std::byte> rows(std::size_t channel, int z, int y, int count);

 private:
  struct Slab {
    VoxelBox box;  // of the level; empty at first
    std::vector<std::byte> voxels;
  };
  void fill(std::size_t channel, int z, int y);

  const ExportJob& job_;
  BoxReader reader_;
  std::size_t row_bytes_;
  int slab_rows_;            // rows of a slice that are held
  int slab_slices_;          // at most
  std::vector<Slab> slabs_;  // one a channel
};

}  // namespace blockwalk
