// SPDX-License-Identifier: Apache-2.0
#include "volume/export/planes.h"

#include <algorithm>
#include <bit>
#include <span>
#include <string>

#include "volume/build/storage.h"
#include "volume/export/box_reader.h"
#include "volume/export/zeros.h"

namespace blockwalk {
namespace {

static_assert(std::endian::native == std::endian::little, "voxels are written as they lie in memory");

constexpr std::size_t kPlanesBytes = std::size_t{16} << 20;

// Takes a piece after the other: of a row of blocks, all or so many as kPlanesBytes hold.
class PlaneWriter {
 public:
  PlaneWriter(const ExportJob& job, OutputFile& file, const PlaneFile& plan)
      : job_(job),
        file_(file),
        begin_(plan.header.size()),
        order_(plan.order),
        reader_(job.file, job.level),
        voxel_bytes_(voxelBytes(job.type())) {}

  void write() {
    const int block = job_.file.info().blockVoxels();
    const std::size_t block_bytes = cellCount(glm::ivec3(block)) * voxel_bytes_;
    const int width = block * static_cast<int>(std::max<std::size_t>(1, kPlanesBytes / block_bytes));
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
    if (job_.is_signed) flipSigns(voxels_, voxel_bytes_);
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

  std::uint64_t offset(std::size_t channel, glm::ivec3 voxel) const {
    const glm::u64vec3 p(voxel - job_.box.begin);
    const glm::u64vec3 dims(job_.box.dims());
    const std::uint64_t slice =
        order_ == PlaneOrder::by_channel ? channel * dims.z + p.z : p.z * job_.channels.size() + channel;
    return begin_ + ((slice * dims.y + p.y) * dims.x + p.x) * voxel_bytes_;
  }

  const ExportJob& job_;
  OutputFile& file_;
  std::uint64_t begin_;
  PlaneOrder order_;
  BoxReader reader_;
  std::size_t voxel_bytes_;
  std::vector<std::byte> voxels_;
};

}  // namespace

std::uint64_t planesBytes(const ExportJob& job) {
  return job.box.voxels() * voxelBytes(job.type()) * job.channels.size();
}

std::uint64_t writePlanes(const ExportJob& job, const PlaneFile& plan, const std::filesystem::path& path) {
  OutputFile file(path);
  const std::uint64_t end = plan.header.size() + planesBytes(job);
  file.setLength(end + plan.trailer.size());
  if (!plan.header.empty()) file.write(0, std::as_bytes(std::span(plan.header)));
  PlaneWriter(job, file, plan).write();
  if (!plan.trailer.empty()) file.write(end, std::as_bytes(std::span(plan.trailer)));
  file.commit();
  return end + plan.trailer.size();
}

}  // namespace blockwalk
