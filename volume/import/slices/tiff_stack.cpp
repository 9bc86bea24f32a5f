// SPDX-License-Identifier: Apache-2.0
// TIFF slices: one a file, or the pages of one file or of a set of files.
#include <algorithm>
#include <optional>
#include <utility>

#include "volume/error.h"
#include "volume/formats/time_step.h"
#include "volume/import/convert/channel.h"
#include "volume/import/geometry.h"
#include "volume/import/openers.h"
#include "volume/import/slices/slice_order.h"
#include "volume/import/slices/slice_shape.h"
#include "volume/import/slices/tiff_description.h"
#include "volume/import/slices/tiff_file.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

using TiffPaths = std::vector<std::filesystem::path>;

SliceShape shapeOf(const TiffPage& page) { return {page.seenWidth(), page.seenHeight(), page.format}; }

// Where the pages are.
struct TiffPages {
  TiffPaths files;
  std::size_t channels = 1;
  std::vector<PageAt> pages;  // slice after slice, of each channel after channel
  std::int64_t planes = 0;    // of the one directory of the one file; 0: directories are what there is
};

class TiffStack final : public Source {
 public:
  TiffStack(TiffPages pages, SourceInfo info, ChannelConverter converter, std::uint64_t memory_bytes, int level)
      : pages_(std::move(pages)),
        info_(std::move(info)),
        converter_(std::move(converter)),
        memory_bytes_(memory_bytes),
        level_(level),
        readers_(pages_.channels) {}

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const auto width = static_cast<std::size_t>(info_.dims.x);
    BLOCKWALK_CHECK(out.size(), ==, channelRowBytes(info_) * info_.channels.size() * static_cast<std::size_t>(count));
    samples_.resize(width * converter_.format().voxelBytes());
    for (std::size_t plane = 0; plane < pages_.channels; ++plane) {
      for (int i = 0; i < count; ++i) {
        readRow(plane, z, y + i);
        const std::size_t first = static_cast<std::size_t>(i) * width;
        if (pages_.channels > 1) {
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
    std::uint32_t file = 0;
  };

  void readRow(std::size_t plane, int z, int y) {
    const PageAt at = pages_.pages[static_cast<std::size_t>(z) * pages_.channels + plane];
    if (at.file == PageAt::kBlank) {
      std::ranges::fill(samples_, std::byte{0});
      return;
    }
    Reader& reader = readers_[plane];
    if (!reader.tiff || at.file != reader.file) {
      reader.tiff.emplace(pages_.files[at.file], memory_bytes_ / pages_.channels, level_);
      if (pages_.planes > 0) reader.tiff->takePlanes(pages_.planes, "images");
      reader.file = at.file;
    }
    reader.tiff->readRow(at.page, y, samples_);
  }

  TiffPages pages_;
  SourceInfo info_;
  ChannelConverter converter_;
  std::uint64_t memory_bytes_;
  int level_;
  std::vector<Reader> readers_;
  std::vector<std::byte> samples_;
};

// What all pages that are read have in common.
class CommonShape {
 public:
  void add(const TiffFile& file, const TiffPage& page) {
    const SliceShape found = shapeOf(page);
    if (!shape_) shape_ = found;
    if (found == *shape_) return;
    failData("{}: page {}: has {}, the first slice has {}", file.name(), page.number, found.text(), shape_->text());
  }
  const SliceShape& get() const { return shape_.value(); }

 private:
  std::optional<SliceShape> shape_;
};

// Of the set, from its file `number`, which is open.
void addUsed(const TiffFile& file, std::uint32_t number, TiffDescription& said, CommonShape& shape) {
  for (PageAt& at : said.pages) {
    if (at.file != number) continue;
    if (number > 0) {  // so far it is the number of a directory
      const auto page = file.pageOfDirectory(at.page);
      if (!page) failData("{}: it has no page {}, which its set names", file.name(), at.page + 1);
      at.page = static_cast<std::uint32_t>(*page);
    }
    shape.add(file, file.pages()[at.page]);
  }
}

// One file, and what it names beside it.
TiffDescription openOne(const std::filesystem::path& path, const ImportOptions& options, CommonShape& shape) {
  TiffFile file(path, options.memory_bytes, options.level.value_or(0));
  TiffDescription said = describePages(file, path, options);
  addUsed(file, 0, said, shape);
  for (std::size_t i = 1; i < said.files.size(); ++i) {
    addUsed(TiffFile(said.files[i], options.memory_bytes, options.level.value_or(0)), static_cast<std::uint32_t>(i),
            said, shape);
  }
  if (said.files.empty()) said.files = {path};
  return said;
}

bool areOfOneSet(const TiffPaths& files, const TiffPaths& set) {
  if (set.size() < 2) return false;
  return std::ranges::all_of(files, [&](const std::filesystem::path& path) {
    return std::ranges::find(set, std::filesystem::absolute(path)) != set.end();
  });
}

// A file a slice; what the first says holds for all.
TiffDescription openEach(const TiffPaths& slices, const ImportOptions& options, CommonShape& shape) {
  TiffDescription all;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    TiffFile file(slices[i], options.memory_bytes, options.level.value_or(0));
    TiffDescription said = describePages(file, slices[i], options);
    if (i == 0 && areOfOneSet(slices, said.files)) return openOne(slices[0], options, shape);
    if (said.channels > 1) {
      failData("{}: holds {} channels; the slices of a stack of files have one each", file.name(), said.channels);
    }
    if (file.pages().size() > 1) {
      failData("{}: has {} pages; the slices of a stack of files have one each", file.name(), file.pages().size());
    }
    shape.add(file, file.pages().front());
    if (i == 0) all = std::move(said);
  }
  all.pages.clear();
  for (std::size_t i = 0; i < slices.size(); ++i) all.pages.push_back({.file = static_cast<std::uint32_t>(i)});
  all.files = slices;
  noteGaps(slices, all.notes);
  return all;
}

// The map from samples to values where the file says one; the colours of pixels have none.
void describeValues(const TiffDescription& said, SourceInfo& info) {
  if (info.type == VoxelType::rgba8) return;
  for (SourceChannel& channel : info.channels) {
    channel.value_offset = said.value_offset + said.value_scale * channel.value_offset;
    channel.value_scale *= said.value_scale;
    channel.unit = said.value_unit;
  }
}

void describePlace(const TiffDescription& said, const ImportOptions& options, const std::string& name,
                   SourceInfo& info) {
  const bool own_size = !options.spacing && said.spacing.has_value();
  Geometry geometry;
  if (own_size && said.corner) {
    geometry.first_center = *said.corner + 0.5 * *said.spacing;
    geometry.corner = said.corner;
  }
  info.world_from_index = worldFromIndex(geometry, own_size ? said.spacing : options.spacing, name,
                                         own_size ? said.spacing_field : "spacing");
  std::string from = said.spacing_from;
  if (said.is_depth_guessed && info.dims.z > 1) from += ", between slices guessed: as along x";
  tellSpacing(options.spacing, from, info);
  info.length_unit = said.length_unit;
  if (own_size && said.is_depth_guessed && info.dims.z > 1) {
    info.notes.emplace_back(
        "the tags do not say how far apart slices are: they are taken to be as far as pixels along x");
  }
}

}  // namespace

std::unique_ptr<Source> openTiff(const std::vector<std::filesystem::path>& slices, const std::string& name,
                                 const ImportOptions& options) {
  CommonShape common;
  TiffDescription said = slices.size() == 1 ? openOne(slices[0], options, common) : openEach(slices, options, common);
  SliceShape shape = common.get();
  SourceInfo info{.name = name, .format = "tiff", .notes = said.notes};
  info.dims = checkedDims(shape.width, shape.height, static_cast<std::int64_t>(said.slices()), name, "size");
  if (options.dims && *options.dims != info.dims) {
    failData("{}: dims: {} x {} x {} were given, the slices make {} x {} x {}", name, options.dims->x, options.dims->y,
             options.dims->z, info.dims.x, info.dims.y, info.dims.z);
  }
  describePlace(said, options, name, info);
  tellRead(said.slices(), "slice", said.files.size(), info);
  if (!said.time_step.empty()) info.facts.emplace_back(kTimeStepKey, said.time_step);
  if (shape.format.channels == 1) shape.format.descending = said.value_scale < 0;
  const std::size_t channels = said.channels;
  ChannelConverter converter = channels > 1 ? ChannelConverter::ofPlanes(shape.format, channels, options, name)
                                            : ChannelConverter(shape.format, true, options, name);
  converter.describe(info, options);
  describeValues(said, info);
  const std::size_t count = info.channels.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (options.channel_names.empty() && count > 1 && said.channel_names.size() == count) {
      info.channels[i].name = said.channel_names[i];
    }
    if (said.channel_colors.size() == count) info.channels[i].color = said.channel_colors[i];
  }
  TiffPages pages{
      .files = std::move(said.files), .channels = channels, .pages = std::move(said.pages), .planes = said.planes};
  return std::make_unique<TiffStack>(std::move(pages), std::move(info), std::move(converter), options.memory_bytes,
                                     options.level.value_or(0));
}

}  // namespace blockwalk
