// SPDX-License-Identifier: Apache-2.0
// TIFF slices: one a file, or the pages of one file.
#include <optional>
#include <utility>

#include "volume/error.h"
#include "volume/import/convert/channel.h"
#include "volume/import/geometry.h"
#include "volume/import/openers.h"
#include "volume/import/slices/slice_shape.h"
#include "volume/import/slices/tiff_description.h"
#include "volume/import/slices/tiff_file.h"

namespace blockwalk {
namespace {

SliceShape shapeOf(const TiffPage& page) { return {page.width, page.height, page.format}; }

// Slices of one file or a file each; a file of slices may hold a page for each channel.
class TiffStack final : public Source {
 public:
  TiffStack(std::vector<std::filesystem::path> files, PageOrder order, SourceInfo info, ChannelConverter converter,
            std::uint64_t memory_bytes)
      : files_(std::move(files)),
        order_(order),
        info_(std::move(info)),
        converter_(std::move(converter)),
        memory_bytes_(memory_bytes),
        readers_(order_.channels) {}

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const auto width = static_cast<std::size_t>(info_.dims.x);
    BLOCKWALK_CHECK(out.size(), ==, channelRowBytes(info_) * info_.channels.size() * static_cast<std::size_t>(count));
    samples_.resize(width * converter_.format().voxelBytes());
    for (std::size_t plane = 0; plane < order_.channels; ++plane) {
      for (int i = 0; i < count; ++i) {
        readRow(plane, z, y + i);
        const std::size_t first = static_cast<std::size_t>(i) * width;
        if (order_.channels > 1) {
          converter_.convertPlane(plane, samples_, first, out);
        } else {
          converter_.convert(samples_, first, out);
        }
      }
    }
  }

 private:
  // A reader for each plane, because a reader keeps the band of one page.
  struct Reader {
    std::optional<TiffFile> tiff;
    std::size_t file = 0;
  };

  void readRow(std::size_t plane, int z, int y) {
    Reader& reader = readers_[plane];
    const bool one_file = files_.size() == 1;
    const std::size_t file = one_file ? 0 : static_cast<std::size_t>(z);
    if (!reader.tiff || file != reader.file) {
      reader.tiff.emplace(files_[file], memory_bytes_ / order_.channels);
      reader.file = file;
    }
    const std::size_t page =
        one_file ? order_.page(static_cast<std::size_t>(z), plane, static_cast<std::size_t>(info_.dims.z)) : 0;
    reader.tiff->readRow(page, y, samples_);
  }

  std::vector<std::filesystem::path> files_;
  PageOrder order_;
  SourceInfo info_;
  ChannelConverter converter_;
  std::uint64_t memory_bytes_;
  std::vector<Reader> readers_;
  std::vector<std::byte> samples_;
};

// What all pages of all files have in common.
struct Pages {
  SliceShape shape;
  TiffDescription description;  // the last file's; of several each holds a slice
  std::int64_t count = 0;
};

Pages commonPages(const std::vector<std::filesystem::path>& slices, std::uint64_t memory_bytes) {
  std::optional<SliceShape> shape;
  TiffDescription description;
  std::int64_t count = 0;
  for (const auto& slice : slices) {
    const TiffFile file(slice, memory_bytes);
    description = describePages(file);
    if (slices.size() > 1 && description.order.channels > 1) {
      failData("{}: holds {} channels; the slices of a stack of files have one each", file.name(),
               description.order.channels);
    }
    if (slices.size() > 1 && file.pages().size() > 1) {
      failData("{}: has {} pages; the slices of a stack of files have one each", file.name(), file.pages().size());
    }
    for (const TiffPage& page : file.pages()) {
      const SliceShape found = shapeOf(page);
      if (!shape) shape = found;
      if (found != *shape) {
        failData("{}: page {}: has {}, the first slice has {}", file.name(), page.number, found.text(), shape->text());
      }
      ++count;
    }
  }
  return {.shape = *shape, .description = std::move(description), .count = count};
}

}  // namespace

std::unique_ptr<Source> openTiff(const std::vector<std::filesystem::path>& slices, const std::string& name,
                                 const ImportOptions& options) {
  const Pages pages = commonPages(slices, options.memory_bytes);
  const SliceShape& shape = pages.shape;
  const TiffDescription& said = pages.description;
  SourceInfo info{.name = name, .format = "tiff"};
  const auto channels = static_cast<std::int64_t>(said.order.channels);
  info.dims = checkedDims(shape.width, shape.height, pages.count / channels, name, "size");
  if (options.dims && *options.dims != info.dims) {
    failData("{}: dims: {} x {} x {} were given, the slices make {} x {} x {}", name, options.dims->x, options.dims->y,
             options.dims->z, info.dims.x, info.dims.y, info.dims.z);
  }
  const bool own_size = !options.spacing && said.spacing.has_value();
  info.world_from_index = worldFromIndex(Geometry{}, own_size ? said.spacing : options.spacing, name,
                                         own_size ? "PhysicalSize" : "spacing");
  info.length_unit = said.length_unit;
  ChannelConverter converter = channels > 1
                                   ? ChannelConverter::ofPlanes(shape.format, said.order.channels, options, name)
                                   : ChannelConverter(shape.format, true, options, name);
  converter.describe(info, options);
  const std::size_t count = info.channels.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (options.channel_names.empty() && count > 1 && said.channel_names.size() == count) {
      info.channels[i].name = said.channel_names[i];
    }
    if (said.channel_colors.size() == count) info.channels[i].color = said.channel_colors[i];
  }
  return std::make_unique<TiffStack>(slices, said.order, std::move(info), std::move(converter), options.memory_bytes);
}

}  // namespace blockwalk
