// SPDX-License-Identifier: Apache-2.0
#include "volume/import/sample_array.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kPieceBytes = std::uint64_t{1} << 20;

class SampleArray final : public Source {
 public:
  SampleArray(SourceInfo info, VoxelConverter converter, std::unique_ptr<ByteReader> bytes)
      : info_(std::move(info)), converter_(std::move(converter)), bytes_(std::move(bytes)) {
    info_.type = converter_.voxelType();
    info_.value_offset = converter_.valueOffset();
    info_.random_access = bytes_->randomAccess();
  }

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion() const override { return converter_.report(); }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const auto width = static_cast<std::uint64_t>(info_.dims.x);
    const std::uint64_t first_row =
        static_cast<std::uint64_t>(z) * static_cast<std::uint64_t>(info_.dims.y) + static_cast<std::uint64_t>(y);
    const std::size_t file_voxel = converter_.format().voxelBytes();
    const std::size_t stored_voxel = voxelBytes(info_.type);
    const std::uint64_t voxels = width * static_cast<std::uint64_t>(count);
    BLOCKWALK_CHECK(out.size(), ==, voxels * stored_voxel);
    const std::uint64_t piece = kPieceBytes / file_voxel;
    samples_.resize(std::min(piece, voxels) * file_voxel);
    for (std::uint64_t done = 0; done < voxels; done += piece) {
      const std::uint64_t now = std::min(piece, voxels - done);
      const auto samples = std::span(samples_).first(now * file_voxel);
      bytes_->read((first_row * width + done) * file_voxel, samples);
      converter_.convert(samples, out.subspan(done * stored_voxel, now * stored_voxel));
    }
  }

 private:
  SourceInfo info_;
  VoxelConverter converter_;
  std::unique_ptr<ByteReader> bytes_;
  std::vector<std::byte> samples_;
};

}  // namespace

std::unique_ptr<Source> makeSampleArray(SourceInfo info, VoxelConverter converter, std::unique_ptr<ByteReader> bytes) {
  return std::make_unique<SampleArray>(std::move(info), std::move(converter), std::move(bytes));
}

}  // namespace blockwalk
