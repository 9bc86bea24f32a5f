// SPDX-License-Identifier: Apache-2.0
// HDF5 files: Imaris, BigDataViewer, ITK, NeXus and datasets by themselves.
#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "volume/error.h"
#include "volume/import/hdf5/hdf5_image.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

Hdf5Image findImage(Hdf5File& file, const ImportOptions& options) {
  const auto root = file.object("");
  if (!root) failData("{}: has no root group", file.name());
  if (options.dataset) {
    const auto named = file.object(*options.dataset);
    if (named && named->array) return findPlain(file, options);
  }
  for (const auto find : {findImaris, findBigDataViewer, findItk, findNexus}) {
    if (auto image = find(file, *root, options)) return std::move(*image);
  }
  return findPlain(file, options);
}

// What datasets that are a channel each must have in common.
void checkAlike(const Hdf5Image& image, const std::string& name) {
  const Hdf5Dataset& first = image.datasets.front();
  for (const Hdf5Dataset& other : image.datasets) {
    if (!first.array.format || !other.array.format) continue;  // is refused by itself
    if (other.array.format != first.array.format || other.part.dims != first.part.dims) {
      failData("{}: '{}' ({}) and '{}' ({}) are no channels of one volume; choose one with --dataset", name, first.path,
               first.array.described(), other.path, other.array.described());
    }
  }
}

std::unique_ptr<Source> makeSource(Hdf5File& file, Hdf5Image image, const ImportOptions& options) {
  checkAlike(image, file.name());
  const Hdf5Dataset& first = image.datasets.front();
  SourceInfo info{.name = file.name(), .format = "hdf5", .dims = first.part.dims, .random_access = true};
  info.world_from_index = worldFromIndex(image.geometry, options.spacing, info.name, "the size of voxels");
  tellSpacing(options.spacing, image.spacing_fields, info);
  info.length_unit = image.length_unit;
  info.space = image.space;
  const std::size_t channels = image.datasets.size() > 1 ? image.datasets.size() : first.part.channels;
  const std::string path = first.path;
  auto chunks = std::make_shared<Hdf5Chunks>(file, image.datasets, options.memory_bytes);
  SampleFormat format = *first.array.format;
  // Stored values ascend with what they mean.
  format.descending = !image.channels.empty() && image.channels.front().value_scale < 0;
  const auto converter = ChannelConverter::ofPlanes(format, channels, options, info.name);
  converter.describe(info, options);
  const bool has_names = channels > 1 && options.channel_names.empty();
  for (std::size_t i = 0; i < std::min(channels, image.channels.size()); ++i) {
    describeAs(image.channels[i], has_names, info.channels[i]);
  }
  if (chunks->isAllFill())
    image.notes.push_back(fmt::format("none of '{}' is there: all of it is the fill value", path));
  info.notes = std::move(image.notes);
  return makeChunkedSource(std::move(chunks), converter, std::move(info));
}

}  // namespace

std::unique_ptr<Source> openHdf5(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  Hdf5File hdf5(std::move(file), options.memory_bytes / 4);
  return makeSource(hdf5, findImage(hdf5, options), options);
}

std::unique_ptr<Source> openSpimData(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  BdvDescription description = readBdvDescription(*file);
  const bool is_absolute = description.is_absolute;
  Hdf5File hdf5(openDataFile(*file, "hdf5", description.data), options.memory_bytes / 4);
  Hdf5Image image = findDescribed(hdf5, std::move(description), options);
  if (is_absolute) {
    image.notes.push_back(fmt::format("its voxels are those of '{}' beside it, whatever folder it names", hdf5.name()));
  }
  return makeSource(hdf5, std::move(image), options);
}

}  // namespace blockwalk
