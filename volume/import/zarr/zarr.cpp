// SPDX-License-Identifier: Apache-2.0
// OME-Zarr and plain Zarr arrays, of version 2 and 3.
#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/formats/time_step.h"
#include "volume/import/chunked_source.h"
#include "volume/import/convert/channel.h"
#include "volume/import/convert/color_source.h"
#include "volume/import/geometry.h"
#include "volume/import/openers.h"
#include "volume/import/part_choice.h"
#include "volume/import/source_facts.h"
#include "volume/import/zarr/ome_image.h"
#include "volume/import/zarr/zarr_chunks.h"
#include "volume/import/zarr/zarr_store.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

// What plain arrays say of their axes, or what is usual.
std::vector<OmeAxis> plainAxes(const ZarrArray& array, std::vector<std::string>& notes) {
  const bool has_x =
      std::ranges::any_of(array.axis_names, [](const std::string& name) { return name == "x" || name == "X"; });
  std::vector<OmeAxis> axes(array.rank());
  if (has_x) {
    for (std::size_t i = 0; i < axes.size(); ++i) axes[i].name = array.axis_names[i];
    return axes;
  }
  constexpr std::string_view kUsual = "tczyx";
  std::string order;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const std::size_t from_end = axes.size() - i;
    axes[i].name =
        from_end <= kUsual.size() ? std::string(1, kUsual[kUsual.size() - from_end]) : fmt::format("axis {}", i);
    if (i > 0) order += ", ";
    order += axes[i].name;
  }
  notes.push_back(fmt::format("the axes are not named: they are taken for {}", order));
  return axes;
}

// Dims, channels and the place on the axes that a volume has not.
ArrayPart choosePart(const ZarrArray& array, const std::vector<OmeAxis>& axes, const ImportOptions& options,
                     std::vector<std::string>& notes) {
  const OmeRoles roles = rolesOf(axes, array.file);
  ArrayPart part = roles.part;
  setPartSizes(array.shape, array.file, part, notes);
  const std::uint64_t step = chosenStep(options, roles.time ? array.shape[*roles.time] : 1, array.file, notes);
  if (roles.time) part.index[*roles.time] = step;
  for (const std::size_t axis : roles.others(array.shape)) {
    notes.push_back(fmt::format("of axis '{}' with {} places it is the first", axes[axis].name, array.shape[axis]));
  }
  return part;
}

// Where the image's map says how far apart its steps are.
std::string timeStepOf(const OmeImage& image, const std::vector<OmeAxis>& axes, const ZarrArray& array) {
  const std::optional<std::size_t> time = rolesOf(axes, array.file).time;
  if (!time || !image.world_from_index || array.shape[*time] < 2 || axes[*time].unit.empty()) return {};
  const auto& rows = image.world_from_index->rows;
  if (*time >= rows.size() || *time >= rows[*time].size()) return {};
  return timeStepText(rows[*time][*time], axes[*time].unit);
}

// Channel after channel.
std::unique_ptr<Source> openChannels(std::shared_ptr<const ZarrStore> store, const ImportOptions& options) {
  OmeImage image = findOmeImage(*store, "", options.level);
  const auto node = readZarrNode(*store, image.key);
  if (!node || !node->is_array) failData("{}: '{}' is no array", store->name(), image.key);
  ZarrArray array = readZarrArray(*node, options.memory_bytes / 4);
  std::vector<OmeAxis> axes = image.axes;
  if (axes.empty()) axes = plainAxes(array, image.notes);
  if (axes.size() != array.rank()) {
    failData("{}: shape has {} axes, the image's metadata say {}", array.file, array.rank(), axes.size());
  }
  ArrayPart part = choosePart(array, axes, options, image.notes);
  const OmePlace place =
      placeOf(image.world_from_index.value_or(OmeMap::identity(axes.size())), axes, part, image.file);
  SourceInfo info{.name = store->name(), .format = "zarr", .dims = part.dims, .random_access = true};
  info.world_from_index = worldFromIndex(place.geometry, options.spacing, image.file, "coordinateTransformations");
  tellSpacing(options.spacing, image.spacing_fields, info);
  info.length_unit = place.length_unit;
  info.space = place.space;
  if (const std::string step = timeStepOf(image, axes, array); !step.empty()) {
    info.facts.emplace_back(kTimeStepKey, step);
  }
  const auto converter = ChannelConverter::ofPlanes(array.format, part.channels, options, info.name);
  converter.describe(info, options);
  const std::vector<std::string> told = describeOmeChannels(image, info.channels);
  image.notes.insert(image.notes.end(), told.begin(), told.end());
  nameChannels(info, options);
  auto chunks = std::make_shared<ZarrChunks>(std::move(store), std::move(array), std::move(part), options.memory_bytes);
  if (chunks->isAllFill()) {
    image.notes.push_back(fmt::format("none of the chunks of '{}' is there: all of it is the fill value{}",
                                      image.key.empty() ? info.name : image.key,
                                      image.levels > 1 ? "; --level chooses another" : ""));
  }
  info.notes = std::move(image.notes);
  return makeChunkedSource(std::move(chunks), converter, std::move(info));
}

std::unique_ptr<Source> openStore(std::shared_ptr<const ZarrStore> store, const ImportOptions& options) {
  if (options.channels != ChannelRule::color) return openChannels(std::move(store), options);
  ImportOptions of_channels = options;
  of_channels.channels = ChannelRule::fields;
  of_channels.density = DensityRule::automatic;  // that of the colour
  of_channels.channel_names.clear();
  return makeColorSource(openChannels(std::move(store), of_channels), options);
}

// A level that is named by its own folder has its place from the image around it.
std::unique_ptr<Source> openZarrAt(const std::filesystem::path& path, const ImportOptions& options) {
  constexpr int kMostFoldersUp = 3;
  const std::filesystem::path folder = std::filesystem::absolute(path / "").lexically_normal().parent_path();
  std::filesystem::path around = folder.parent_path();
  for (int i = 0; i < kMostFoldersUp && !options.level && isZarrFolder(folder); ++i, around = around.parent_path()) {
    if (!isZarrFolder(around)) continue;
    auto image = openZarrFolder(around);
    if (const auto level = omeLevelAt(*image, folder.lexically_relative(around).generic_string())) {
      ImportOptions of_level = options;
      of_level.level = level;
      return openStore(std::move(image), of_level);
    }
  }
  return openStore(openZarrFolder(folder), options);
}

}  // namespace

bool isZarrFolder(const std::filesystem::path& folder) {
  return std::ranges::any_of(std::array{"zarr.json", ".zarray", ".zgroup", ".zattrs"}, [&](const char* name) {
    std::error_code absent;
    return std::filesystem::is_regular_file(folder / name, absent);
  });
}

std::unique_ptr<Source> openZarr(const std::filesystem::path& path, const ImportOptions& options) {
  std::error_code absent;
  if (std::filesystem::is_directory(path, absent)) return openZarrAt(path, options);
  return openStore(openZarrZip(path, options.memory_bytes / 4), options);
}

}  // namespace blockwalk
