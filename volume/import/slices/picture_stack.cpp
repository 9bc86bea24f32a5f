// SPDX-License-Identifier: Apache-2.0
// Slices that are JPEG, JPEG 2000, WebP or GIF pictures: one a file, or those of one animation.
#include <algorithm>
#include <utility>

#include "volume/error.h"
#include "volume/import/convert/channel.h"
#include "volume/import/geometry.h"
#include "volume/import/openers.h"
#include "volume/import/slices/picture_file.h"
#include "volume/import/slices/slice_order.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

using Paths = std::vector<std::filesystem::path>;

class PictureStack final : public Source {
 public:
  PictureStack(Paths files, SliceShape shape, SourceInfo info, ChannelConverter converter, std::uint64_t memory_bytes)
      : files_(std::move(files)),
        shape_(shape),
        info_(std::move(info)),
        converter_(std::move(converter)),
        memory_bytes_(memory_bytes),
        picture_(cellCount({shape.width, shape.height, 1}) * shape.format.voxelBytes()) {}

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    while (read_ <= z) readNext();
    const std::size_t row_bytes = static_cast<std::size_t>(shape_.width) * shape_.format.voxelBytes();
    const auto rows = std::span(picture_).subspan(static_cast<std::size_t>(y) * row_bytes,
                                                  static_cast<std::size_t>(count) * row_bytes);
    samples_.assign(rows.begin(), rows.end());
    converter_.convert(samples_, 0, out);
  }

 private:
  void readNext() {
    if (!file_ || left_ == 0) {
      file_ = openPicture(files_[next_file_++], memory_bytes_);
      left_ = file_->pictures();
    }
    file_->readNext(picture_);
    --left_;
    ++read_;
  }

  Paths files_;
  SliceShape shape_;
  SourceInfo info_;
  ChannelConverter converter_;
  std::uint64_t memory_bytes_;
  std::vector<std::byte> picture_;
  std::vector<std::byte> samples_;
  std::unique_ptr<PictureFile> file_;
  std::size_t next_file_ = 0;
  int left_ = 0;  // pictures of the file
  int read_ = 0;
};

}  // namespace

std::unique_ptr<Source> openPictures(const Paths& slices, const std::string& name, const ImportOptions& options) {
  const std::uint64_t memory = options.memory_bytes / 4;
  std::optional<SliceShape> shape;
  std::int64_t count = 0;
  for (const auto& slice : slices) {
    const auto file = openPicture(slice, memory);
    const SliceShape found = file->shape();
    if (shape && found != *shape)
      failData("{}: has {}, the first slice has {}", slice.string(), found.text(), shape->text());
    shape = found;
    if (file->pictures() > 1 && slices.size() > 1) {
      failData("{}: has {} pictures; of several files each is one slice", slice.string(), file->pictures());
    }
    count += file->pictures();
  }
  SourceInfo info{.name = name, .format = "pictures"};
  info.dims = checkedDims(shape->width, shape->height, count, name, "size");
  if (options.dims && *options.dims != info.dims) {
    failData("{}: dims: {} x {} x {} were given, the slices make {} x {} x {}", name, options.dims->x, options.dims->y,
             options.dims->z, info.dims.x, info.dims.y, info.dims.z);
  }
  info.world_from_index = worldFromIndex(Geometry{}, options.spacing, name, "spacing");
  tellSpacing(options.spacing, "", info);
  tellRead(static_cast<std::uint64_t>(count), "slice", slices.size(), info);
  if (slices.size() > 1) noteGaps(slices, info.notes);
  ChannelConverter converter(shape->format, true, options, name);
  converter.describe(info, options);
  return std::make_unique<PictureStack>(slices, *shape, std::move(info), std::move(converter), memory);
}

}  // namespace blockwalk
