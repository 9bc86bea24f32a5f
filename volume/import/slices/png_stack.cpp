// SPDX-License-Identifier: Apache-2.0
// PNG slices: one a file, or the tiles of one file.
#include <algorithm>
#include <optional>
#include <utility>

#include "volume/error.h"
#include "volume/import/convert/channel.h"
#include "volume/import/geometry.h"
#include "volume/import/openers.h"
#include "volume/import/slices/png_reader.h"
#include "volume/import/slices/slice_order.h"
#include "volume/import/slices/slice_shape.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

SliceShape shapeOf(const std::filesystem::path& path, std::uint64_t memory_bytes) {
  const PngReader reader(path, memory_bytes);
  return {reader.width(), reader.height(), reader.format()};
}

class PngStack final : public Source {
 public:
  PngStack(std::vector<std::filesystem::path> files, SliceShape shape, int columns, SourceInfo info,
           ChannelConverter converter, std::uint64_t memory_bytes)
      : files_(std::move(files)),
        shape_(shape),
        columns_(columns),
        info_(std::move(info)),
        converter_(std::move(converter)),
        memory_bytes_(memory_bytes),
        row_bytes_(static_cast<std::size_t>(shape.width) * shape.format.voxelBytes()) {
    // Tiles that lie side by side share rows of the image, so a row of tiles is kept.
    rows_kept_ = columns_ > 1 ? info_.dims.y : 1;
    const std::uint64_t kept = static_cast<std::uint64_t>(row_bytes_) * static_cast<std::uint64_t>(rows_kept_);
    if (kept > memory_bytes_) {
      failData("{}: a row of tiles takes {} bytes, {} bytes of memory are allowed; raise --memory", info_.name, kept,
               memory_bytes_);
    }
    kept_.resize(kept);
  }

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const auto width = static_cast<std::size_t>(info_.dims.x);
    const std::size_t file_voxel = shape_.format.voxelBytes();
    BLOCKWALK_CHECK(out.size(), ==, channelRowBytes(info_) * info_.channels.size() * static_cast<std::size_t>(count));
    samples_.resize(width * file_voxel);
    for (int i = 0; i < count; ++i) {
      const std::span<const std::byte> row = imageRow(z, y + i);
      const std::size_t first = static_cast<std::size_t>(files_.size() > 1 ? 0 : z % columns_) * width * file_voxel;
      std::copy_n(row.begin() + static_cast<std::ptrdiff_t>(first), samples_.size(), samples_.begin());
      converter_.convert(samples_, static_cast<std::size_t>(i) * width, out);
    }
  }

 private:
  // The whole image row in which row y of slice z lies.
  std::span<const std::byte> imageRow(int z, int y) {
    const std::size_t file = files_.size() > 1 ? static_cast<std::size_t>(z) : 0;
    const int tile_row = files_.size() > 1 ? 0 : z / columns_;
    const int row = tile_row * info_.dims.y + y;
    const int first = row - row % rows_kept_;
    if (!reader_ || file != file_ || first < next_row_ - rows_kept_) {
      reader_.emplace(files_[file], memory_bytes_);
      file_ = file;
      next_row_ = 0;
    }
    while (next_row_ < first + rows_kept_) {
      const auto slot = static_cast<std::size_t>(next_row_ % rows_kept_) * row_bytes_;
      reader_->readRow(std::span(kept_).subspan(slot, row_bytes_));
      ++next_row_;
    }
    return std::span(kept_).subspan(static_cast<std::size_t>(row % rows_kept_) * row_bytes_, row_bytes_);
  }

  std::vector<std::filesystem::path> files_;
  SliceShape shape_;
  int columns_;
  SourceInfo info_;
  ChannelConverter converter_;
  std::uint64_t memory_bytes_;
  std::size_t row_bytes_;
  int rows_kept_ = 1;
  std::vector<std::byte> kept_;
  std::vector<std::byte> samples_;
  std::optional<PngReader> reader_;
  std::size_t file_ = 0;
  int next_row_ = 0;
};

// How many tiles lie side by side; throws DataError when the tiles do not fill the image or are too few.
int tileColumns(const std::string& name, const SliceShape& shape, glm::ivec3 dims) {
  if (shape.width % dims.x != 0 || shape.height % dims.y != 0) {
    failData("{}: dims: {} x {} pixels do not divide into slices of {} x {}", name, shape.width, shape.height, dims.x,
             dims.y);
  }
  const std::int64_t columns = shape.width / dims.x;
  const std::int64_t tiles = columns * (shape.height / dims.y);
  if (tiles < dims.z) failData("{}: dims: the image has {} tiles, {} slices are asked for", name, tiles, dims.z);
  return static_cast<int>(columns);
}

}  // namespace

std::unique_ptr<Source> openPng(const std::vector<std::filesystem::path>& slices, const std::string& name,
                                const ImportOptions& options) {
  const SliceShape shape = shapeOf(slices.front(), options.memory_bytes);
  for (const auto& slice : slices) {
    const SliceShape found = shapeOf(slice, options.memory_bytes);
    if (found != shape) {
      failData("{}: has {}, the first slice has {}", slice.string(), found.text(), shape.text());
    }
  }
  const auto count = static_cast<std::int64_t>(slices.size());
  SourceInfo info{.name = name, .format = "png"};
  int columns = 1;
  if (options.dims && slices.size() == 1) {
    info.dims = checkedDims(options.dims->x, options.dims->y, options.dims->z, name, "dims");
    columns = tileColumns(name, shape, info.dims);
  } else {
    info.dims = checkedDims(shape.width, shape.height, count, name, "size");
    if (options.dims && *options.dims != info.dims) {
      failData("{}: dims: {} x {} x {} were given, the slices make {} x {} x {}", name, options.dims->x,
               options.dims->y, options.dims->z, info.dims.x, info.dims.y, info.dims.z);
    }
  }
  info.world_from_index = worldFromIndex(Geometry{}, options.spacing, name, "spacing");
  tellSpacing(options.spacing, "", info);
  tellRead(static_cast<std::uint64_t>(info.dims.z), slices.size() > 1 ? "slice" : "tile", slices.size(), info);
  if (slices.size() > 1) noteGaps(slices, info.notes);
  ChannelConverter converter(shape.format, true, options, name);
  converter.describe(info, options);
  return std::make_unique<PngStack>(slices, shape, columns, std::move(info), std::move(converter),
                                    options.memory_bytes);
}

}  // namespace blockwalk
