// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/bricks/brick_cubes.h"
#include "volume/import/bricks/prism_metadata.h"
#include "volume/import/convert/channel.h"
#include "volume/import/geometry.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

// What the sources of several threads share.
struct PrismFolder {
  PrismFolder(std::shared_ptr<const InputFile> header, std::uint64_t memory_bytes)
      : metadata(readPrismMetadata(*header)),
        files(std::move(header), metadata),
        cubes(metadata, files, memory_bytes) {}

  PrismMetadata metadata;
  BrickFiles files;
  BrickCubes cubes;
};

class PrismSource final : public Source {
 public:
  PrismSource(std::shared_ptr<PrismFolder> folder, SourceInfo info)
      : folder_(std::move(folder)), info_(std::move(info)), width_(voxelBytes(info_.type)) {}

  const SourceInfo& info() const override { return info_; }
  std::unique_ptr<Source> another() const override { return std::make_unique<PrismSource>(folder_, info_); }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const std::size_t row = channelRowBytes(info_);
    BLOCKWALK_CHECK(out.size(), ==, static_cast<std::size_t>(count) * row);
    // No brick begins or ends inside one of these lines of cells.
    const int cell = folder_->metadata.least_side;
    for (int begin = y; begin < y + count;) {
      const int end = std::min(y + count, (begin / cell + 1) * cell);
      readCells({.first = {0, begin, z}, .rows = end - begin}, out.subspan(static_cast<std::size_t>(begin - y) * row));
      begin = end;
    }
    const bool swap = folder_->metadata.big_endian != (std::endian::native == std::endian::big);
    if (!swap || width_ == 1) return;
    for (std::size_t i = 0; i < out.size(); i += 2) std::swap(out[i], out[i + 1]);
  }

 private:
  // Rows that lie in the same bricks, from a voxel on.
  struct Rows {
    glm::ivec3 first{0};
    int rows = 0;
  };

  void readCells(Rows rows, std::span<std::byte> out) {
    const PrismMetadata& metadata = folder_->metadata;
    while (rows.first.x < info_.dims.x) {
      const Brick* brick = metadata.brickAt(rows.first);
      const int end =
          std::min(info_.dims.x, brick != nullptr ? brick->position.x + brick->side
                                                  : (rows.first.x / metadata.least_side + 1) * metadata.least_side);
      if (brick == nullptr) {
        forEachRow(rows, end, out, [](int, std::span<std::byte> voxels) { std::ranges::fill(voxels, std::byte{0}); });
      } else if (brick->is_hz) {
        readCubes(*brick, rows, end, out);
      } else {
        readRaster(*brick, rows, end, out);
      }
      rows.first.x = end;
    }
  }

  // Calls take(i, voxels) with the place of voxels first.x..end - 1 of row i.
  template <typename Take>
  void forEachRow(const Rows& rows, int end, std::span<std::byte> out, Take take) const {
    const std::size_t bytes = static_cast<std::size_t>(end - rows.first.x) * width_;
    std::size_t at = static_cast<std::size_t>(rows.first.x) * width_;
    for (int i = 0; i < rows.rows; ++i, at += channelRowBytes(info_)) take(i, out.subspan(at, bytes));
  }

  void readCubes(const Brick& brick, Rows rows, int end, std::span<std::byte> out) {
    const int side = folder_->cubes.sideOf(brick);
    for (; rows.first.x < end; rows.first.x += side) {
      BrickCubes::Cube cube;
      forEachRow(rows, std::min(end, rows.first.x + side), out, [&](int i, std::span<std::byte> voxels) {
        const glm::ivec3 voxel = rows.first + glm::ivec3(0, i, 0);
        if (i == 0 || voxel.y % side == 0) cube = folder_->cubes.get(brick, voxel);
        const auto from = static_cast<std::size_t>((voxel.z % side * side + voxel.y % side) * side) * width_;
        std::memcpy(voxels.data(), cube->data() + from, voxels.size());
      });
    }
  }

  void readRaster(const Brick& brick, const Rows& rows, int end, std::span<std::byte> out) {
    const glm::ivec3 local = rows.first - brick.position;
    const std::size_t row = static_cast<std::size_t>(brick.side) * width_;
    const std::uint64_t first = static_cast<std::uint64_t>(local.z) * static_cast<std::uint64_t>(brick.side) +
                                static_cast<std::uint64_t>(local.y);
    rows_.resize(static_cast<std::size_t>(rows.rows) * row);
    folder_->files.open(brick)->read(first * row, rows_);
    forEachRow(rows, end, out, [&](int i, std::span<std::byte> voxels) {
      std::memcpy(voxels.data(), rows_.data() + static_cast<std::size_t>(i) * row, voxels.size());
    });
  }

  std::shared_ptr<PrismFolder> folder_;
  SourceInfo info_;
  std::size_t width_;
  std::vector<std::byte> rows_;
};

}  // namespace

std::unique_ptr<Source> openPrism(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const auto folder = std::make_shared<PrismFolder>(file, options.memory_bytes);
  const PrismMetadata& metadata = folder->metadata;
  for (const Brick& brick : metadata.bricks) folder->files.open(brick);
  const std::string name = std::filesystem::absolute(file->path()).parent_path().filename().string();
  SourceInfo info{.name = name.empty() ? file->name() : name, .format = "prism", .dims = metadata.dims};
  Geometry geometry;
  for (int i = 0; i < 3; ++i) geometry.axes[static_cast<std::size_t>(i)] *= metadata.scale[i];
  info.world_from_index = worldFromIndex(geometry, options.spacing, file->name(), "scale");
  tellSpacing(options.spacing, "scale", info);
  tellRead(metadata.bricks.size(), "brick", metadata.bricks.size(), info);
  const SampleType type = metadata.bytes_per_voxel == 1 ? SampleType::u8 : SampleType::u16;
  ChannelConverter({.type = type}, false, options, info.name).describe(info, options);
  info.random_access = true;
  if (!metadata.dims_said) {
    info.notes.emplace_back(
        "the files do not say the true size: the volume ends where the bricks do, and their padding of zeros is empty");
  }
  return std::make_unique<PrismSource>(folder, std::move(info));
}

}  // namespace blockwalk
