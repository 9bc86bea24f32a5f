// SPDX-License-Identifier: Apache-2.0
#include "volume/export/planes.h"

#include <algorithm>
#include <bit>
#include <span>
#include <string>

#include "volume/export/box_reader.h"
#include "volume/export/zeros.h"

namespace blockwalk {
namespace {

static_assert(std::endian::native == std::endian::little, "voxels are written as they lie in memory");

constexpr std::size_t kPieceBytes = std::size_t{16} << 20;

// Takes a piece after the other: of a row of blocks, all or so many as kPieceBytes hold.
class PlaneWriter {
 public:
  PlaneWriter(const ExportJob& job, OutputFile& file, std::uint64_t begin)
      : job_(job), file_(file), begin_(begin), reader_(job.file, job.level), voxel_bytes_(voxelBytes(job.type())) {}

  void write() {
    const int block = job_.file.info().blockVoxels();
    const std::size_t block_bytes = cellCount(glm::ivec3(block)) * voxel_bytes_;
    const int width = block * static_cast<int>(std::max<std::size_t>(1, kPieceBytes / block_bytes));
    const VoxelBox& box = job_.box;
    const auto slices = static_cast<std::uint64_t>(box.dims().z);
    for (std::size_t channel = 0; channel < job_.channels.size(); ++channel) {
      for (int z = box.begin.z; z < box.end.z; z = after(z, block, box.end.z)) {
        for (int y = box.begin.y; y < box.end.y; y = after(y, block, box.end.y)) {
          for (int x = box.begin.x; x < box.end.x; x = after(x, width, box.end.x)) {
            const glm::ivec3 end(after(x, width, box.end.x), after(y, block, box.end.y), after(z, block, box.end.z));
            writePiece(channel, {{x, y, z}, end});
          }
        }
        if (job_.progress) {
          const int done = after(z, block, box.end.z) - box.begin.z;
          job_.progress("write", channel * slices + static_cast<std::uint64_t>(done), job_.channels.size() * slices);
        }
      }
    }
  }

 private:
  // The next multiple of `step`, `end` at most.
  static int after(int position, int step, int end) {
    return static_cast<int>(std::min<std::int64_t>((std::int64_t{position} / step + 1) * step, end));
  }

  void writePiece(std::size_t channel, const VoxelBox& piece) {
    voxels_.resize(piece.voxels() * voxel_bytes_);
    reader_.read(job_.channels[channel], piece, voxels_);
    if (job_.is_signed) flipSigns();
    const glm::ivec3 dims = piece.dims();
    const bool is_whole = dims.x == job_.box.dims().x;  // then its rows of a slice are a run of the file
    const int rows = is_whole ? dims.y : 1;
    const std::size_t bytes = static_cast<std::size_t>(rows) * static_cast<std::size_t>(dims.x) * voxel_bytes_;
    std::span<const std::byte> left = voxels_;
    for (int z = piece.begin.z; z < piece.end.z; ++z) {
      for (int y = piece.begin.y; y < piece.end.y; y += rows, left = left.subspan(bytes)) {
        if (!isZero(left.first(bytes))) file_.write(offset(channel, {piece.begin.x, y, z}), left.first(bytes));
      }
    }
  }

  void flipSigns() {
    for (std::size_t i = voxel_bytes_ - 1; i < voxels_.size(); i += voxel_bytes_) voxels_[i] ^= std::byte{0x80};
  }

  std::uint64_t offset(std::size_t channel, glm::ivec3 voxel) const {
    const glm::u64vec3 p(voxel - job_.box.begin);
    const glm::u64vec3 dims(job_.box.dims());
    return begin_ + (((channel * dims.z + p.z) * dims.y + p.y) * dims.x + p.x) * voxel_bytes_;
  }

  const ExportJob& job_;
  OutputFile& file_;
  std::uint64_t begin_;
  BoxReader reader_;
  std::size_t voxel_bytes_;
  std::vector<std::byte> voxels_;
};

}  // namespace

std::uint64_t planesBytes(const ExportJob& job) {
  return job.box.voxels() * voxelBytes(job.type()) * job.channels.size();
}

void writePlanes(const ExportJob& job, OutputFile& file, std::uint64_t begin) {
  file.setLength(begin + planesBytes(job));
  PlaneWriter(job, file, begin).write();
}

std::uint64_t writeRaw(const ExportJob& job, const std::filesystem::path& path) {
  OutputFile file(path);
  writePlanes(job, file, 0);
  file.commit();
  return planesBytes(job);
}

}  // namespace blockwalk
