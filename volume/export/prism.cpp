// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "volume/build/storage.h"
#include "volume/export/box_reader.h"
#include "volume/export/brick_partition.h"
#include "volume/export/export_job.h"
#include "volume/export/output_folder.h"
#include "volume/export/zeros.h"
#include "volume/formats/hz_order.h"

namespace blockwalk {
namespace {

// One brick after the other: its voxels in rows, then in the order of the file.
class BrickWriter {
 public:
  BrickWriter(const ExportJob& job, const std::filesystem::path& folder)
      : job_(job), folder_(folder), reader_(job.file, job.level), voxel_bytes_(voxelBytes(job.type())) {
    for (std::size_t i = 0; i < spread_.size(); ++i) spread_[i] = mortonCode({static_cast<unsigned>(i), 0, 0});
  }

  std::uint64_t write(std::size_t number, const BrickPlace& brick) {
    const VoxelBox piece{job_.box.begin + brick.position,
                         glm::min(job_.box.begin + brick.position + brick.side, job_.box.end)};
    rows_.resize(piece.voxels() * voxel_bytes_);
    reader_.read(job_.channels[0], piece, rows_);
    const std::uint64_t bytes = cellCount(glm::ivec3(brick.side)) * voxel_bytes_;
    OutputFile file(folder_ / brickFileName(number));
    file.setLength(bytes);
    if (!isZero(rows_)) {
      brick_.assign(bytes, std::byte{0});
      if (voxel_bytes_ == 1) {
        order<std::uint8_t>(piece.dims(), brick.side);
      } else {
        order<std::uint16_t>(piece.dims(), brick.side);
      }
      file.write(0, brick_);
    }
    file.commit();
    return bytes;
  }

 private:
  template <typename T>
  void order(glm::ivec3 dims, int side) {
    const int bits = sideBits(side);
    const std::byte* from = rows_.data();
    for (int z = 0; z < dims.z; ++z) {
      for (int y = 0; y < dims.y; ++y) {
        const std::uint64_t row = spread(y) << 1 | spread(z) << 2;
        for (int x = 0; x < dims.x; ++x, from += sizeof(T)) {
          std::byte* to = brick_.data() + hzFromMorton(spread(x) | row, bits) * sizeof(T);
          to[0] = from[sizeof(T) - 1];  // the highest byte first
          if constexpr (sizeof(T) == 2) to[1] = from[0];
        }
      }
    }
  }
  std::uint64_t spread(int i) const { return spread_[static_cast<std::size_t>(i)]; }

  const ExportJob& job_;
  std::filesystem::path folder_;
  BoxReader reader_;
  std::size_t voxel_bytes_;
  std::vector<std::uint64_t> spread_ = std::vector<std::uint64_t>(kGreatestBrick);  // bits of a number, each third
  std::vector<std::byte> rows_;
  std::vector<std::byte> brick_;
};

}  // namespace

Written writePrism(const ExportJob& job, const std::filesystem::path& path) {
  requireTypes(job, "PRISM", std::array{VoxelType::u8, VoxelType::u16});
  requireOneChannel(job, "PRISM");
  const glm::ivec3 dims = job.box.dims();
  const std::vector<BrickPlace> bricks = partitionBricks(dims, path.string());
  OutputFolder folder(path);
  BrickWriter writer(job, folder.partialPath());
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    bytes += writer.write(i, bricks[i]);
    if (job.progress) job.progress("write", i + 1, bricks.size());
  }
  const std::string text = brickMetadata(bricks, dims, job.spacing(), static_cast<int>(voxelBytes(job.type())));
  OutputFile metadata(folder.partialPath() / "metadata.json");
  metadata.write(0, std::as_bytes(std::span(text)));
  metadata.commit();
  folder.commit();
  Written written{.bytes = bytes + text.size()};
  noteSpacingAlone(job, written.notes);
  noteStoredValues(job, written.notes);
  noteNames(job, written.notes);
  return written;
}

}  // namespace blockwalk
