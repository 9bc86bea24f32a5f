// SPDX-License-Identifier: Apache-2.0
#include "volume/export/row_reader.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "volume/error.h"

namespace blockwalk {

RowReader::RowReader(const ExportJob& job, std::size_t memory_bytes, std::shared_ptr<const StoredBlocks> blocks)
    : job_(job),
      reader_(job.file, job.level, std::move(blocks)),
      row_bytes_(static_cast<std::size_t>(job.box.dims().x) * voxelBytes(job.type())),
      slabs_(job.channels.size()) {
  const std::size_t most_rows = std::max<std::size_t>(1, memory_bytes / slabs_.size() / row_bytes_);
  const auto rows = static_cast<std::size_t>(job.box.dims().y);
  slab_rows_ = static_cast<int>(std::min(rows, most_rows));
  const auto block = static_cast<std::size_t>(job.file.info().blockVoxels());
  slab_slices_ = static_cast<int>(most_rows < rows ? 1 : std::min(block, most_rows / rows));
}

int RowReader::rowsAt(int y) const { return std::min(slab_rows_ - y % slab_rows_, job_.box.dims().y - y); }

// Slabs end where blocks do, if they can.
void RowReader::fill(std::size_t channel, int z, int y) {
  Slab& slab = slabs_[channel];
  const int block = job_.file.info().blockVoxels();
  const int begin = job_.box.begin.z + z;
  const int end = std::min({begin + slab_slices_, (begin / block + 1) * block, job_.box.end.z});
  const int first = job_.box.begin.y + y / slab_rows_ * slab_rows_;
  slab.box = {{job_.box.begin.x, first, begin}, {job_.box.end.x, std::min(first + slab_rows_, job_.box.end.y), end}};
  slab.voxels.resize(slab.box.voxels() * voxelBytes(job_.type()));
  reader_.read(job_.channels[channel], slab.box, slab.voxels);
  if (job_.is_signed) flipSigns(slab.voxels, voxelBytes(job_.type()));
}

std::span<const std::byte> RowReader::rows(std::size_t channel, int z, int y, int count) {
  BLOCKWALK_CHECK(count, <=, rowsAt(y));
  Slab& slab = slabs_[channel];
  const glm::ivec3 first = job_.box.begin + glm::ivec3(0, y, z);
  const bool is_held = first.z >= slab.box.begin.z && first.z < slab.box.end.z && first.y >= slab.box.begin.y &&
                       first.y < slab.box.end.y;
  if (!is_held) fill(channel, z, y);
  const auto rows_before =
      static_cast<std::size_t>(first.z - slab.box.begin.z) * static_cast<std::size_t>(slab.box.dims().y) +
      static_cast<std::size_t>(first.y - slab.box.begin.y);
  return std::span(slab.voxels).subspan(rows_before * row_bytes_, static_cast<std::size_t>(count) * row_bytes_);
}

}  // namespace blockwalk
