// SPDX-License-Identifier: Apache-2.0
// TIFF slices: one a file, or the pages of one file.
#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "volume/error.h"
#include "volume/import/formats.h"
#include "volume/import/geometry.h"
#include "volume/import/header_text.h"
#include "volume/import/tiff_file.h"
#include "volume/import/voxel_converter.h"

namespace blockwalk {
namespace {

struct PageShape {
  int width = 0;
  int height = 0;
  SampleFormat format;
  bool operator==(const PageShape&) const = default;
};

PageShape shapeOf(const TiffPage& page) { return {page.width, page.height, page.format}; }

std::string describe(const PageShape& shape) {
  return fmt::format("{} x {} pixels of {} x {}", shape.width, shape.height, shape.format.channels,
                     sampleTypeName(shape.format.type));
}

// The number behind `key`, as in ImageJ's "channels=2" and OME-XML's SizeC="2".
std::optional<std::int64_t> numberAfter(std::string_view text, std::string_view key) {
  const std::size_t found = text.find(key);
  if (found == std::string_view::npos) return std::nullopt;
  const std::string_view rest = text.substr(found + key.size());
  return parseInteger(rest.substr(0, std::min(rest.find_first_not_of("0123456789"), rest.size())));
}

// Pages that are channels or times are no slices, and nothing but the description says so.
void refuseHyperstack(const TiffFile& file) {
  const TiffPage& page = file.pages().front();
  const std::string_view text = page.description;
  const auto pages = static_cast<std::int64_t>(file.pages().size());
  if (text.starts_with("ImageJ=")) {
    const std::int64_t channels = numberAfter(text, "\nchannels=").value_or(1);
    const std::int64_t frames = numberAfter(text, "\nframes=").value_or(1);
    const std::int64_t slices = numberAfter(text, "\nslices=").value_or(1);
    const std::int64_t images = numberAfter(text, "\nimages=").value_or(pages);
    if (channels > 1 && page.format.channels == 1) {
      failData("{}: ImageDescription: channels={}: the {} pages are those of {} channels; split them into a file each",
               file.name(), channels, pages, channels);
    }
    if (frames > 1 && slices > 1) {
      failData("{}: ImageDescription: frames={}: the pages are a series in time; split it into a file a time",
               file.name(), frames);
    }
    if (images > pages) {
      failData("{}: ImageDescription: images={}, but the file has {} pages; the data behind them cannot be read",
               file.name(), images, pages);
    }
    return;
  }
  for (const std::string_view axis : {" SizeC=\"", " SizeT=\""}) {
    const std::int64_t size = numberAfter(text, axis).value_or(1);
    if (text.find("<OME") != std::string_view::npos && size > 1 && size != page.format.channels) {
      failData("{}: ImageDescription:{}{}\": the pages are no slices of one volume; split them into a file each",
               file.name(), axis, size);
    }
  }
}

class TiffStack final : public Source {
 public:
  TiffStack(std::vector<std::filesystem::path> files, SourceInfo info, VoxelConverter converter,
            std::uint64_t memory_bytes)
      : files_(std::move(files)),
        info_(std::move(info)),
        converter_(std::move(converter)),
        memory_bytes_(memory_bytes) {
    info_.type = converter_.voxelType();
    info_.value_offset = converter_.valueOffset();
  }

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion() const override { return converter_.report(); }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const auto width = static_cast<std::size_t>(info_.dims.x);
    const std::size_t stored_row = width * voxelBytes(info_.type);
    BLOCKWALK_CHECK(out.size(), ==, stored_row * static_cast<std::size_t>(count));
    const bool one_file = files_.size() == 1;
    const std::size_t file = one_file ? 0 : static_cast<std::size_t>(z);
    const std::size_t page = one_file ? static_cast<std::size_t>(z) : 0;
    if (!tiff_ || file != file_) {
      tiff_.emplace(files_[file], memory_bytes_);
      file_ = file;
    }
    samples_.resize(width * converter_.format().voxelBytes());
    for (int i = 0; i < count; ++i) {
      tiff_->readRow(page, y + i, samples_);
      converter_.convert(samples_, out.subspan(static_cast<std::size_t>(i) * stored_row, stored_row));
    }
  }

 private:
  std::vector<std::filesystem::path> files_;
  SourceInfo info_;
  VoxelConverter converter_;
  std::uint64_t memory_bytes_;
  std::optional<TiffFile> tiff_;
  std::size_t file_ = 0;
  std::vector<std::byte> samples_;
};

// The shape that all pages of all files have.
PageShape commonShape(const std::vector<std::filesystem::path>& slices, std::uint64_t memory_bytes,
                      std::int64_t& count) {
  std::optional<PageShape> shape;
  count = 0;
  for (const auto& slice : slices) {
    const TiffFile file(slice, memory_bytes);
    refuseHyperstack(file);
    if (slices.size() > 1 && file.pages().size() > 1) {
      failData("{}: has {} pages; the slices of a stack of files have one each", file.name(), file.pages().size());
    }
    for (const TiffPage& page : file.pages()) {
      const PageShape found = shapeOf(page);
      if (!shape) shape = found;
      if (found != *shape) {
        failData("{}: page {}: has {}, the first slice has {}", file.name(), page.number, describe(found),
                 describe(*shape));
      }
      ++count;
    }
  }
  return *shape;
}

}  // namespace

std::unique_ptr<Source> openTiff(const std::vector<std::filesystem::path>& slices, const std::string& name,
                                 const ImportOptions& options) {
  std::int64_t count = 0;
  const PageShape shape = commonShape(slices, options.memory_bytes, count);
  SourceInfo info{.name = name, .format = "tiff"};
  info.dims = checkedDims(shape.width, shape.height, count, name, "size");
  if (options.dims && *options.dims != info.dims) {
    failData("{}: dims: {} x {} x {} were given, the slices make {} x {} x {}", name, options.dims->x, options.dims->y,
             options.dims->z, info.dims.x, info.dims.y, info.dims.z);
  }
  info.world_from_index = worldFromIndex(Geometry{}, options.spacing, name, "spacing");
  VoxelConverter converter(shape.format, options.density, name);
  return std::make_unique<TiffStack>(slices, std::move(info), std::move(converter), options.memory_bytes);
}

}  // namespace blockwalk
