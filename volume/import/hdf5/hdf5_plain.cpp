// SPDX-License-Identifier: Apache-2.0
// Datasets by themselves: those of MATLAB, ilastik, Fiji, netCDF and of whoever writes arrays.
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "volume/error.h"
#include "volume/formats/length_unit.h"
#include "volume/import/frame.h"
#include "volume/import/hdf5/hdf5_image.h"
#include "volume/import/hdf5/hdf5_scales.h"
#include "volume/import/header_text.h"
#include "volume/import/zarr/ome_axes.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

std::size_t longAxes(const Hdf5Array& array) {
  return static_cast<std::size_t>(std::ranges::count_if(array.shape, [](std::uint64_t size) { return size > 1; }));
}

std::string listedDatasets(const std::vector<Hdf5Object>& datasets) {
  constexpr std::size_t kMostListed = 10;
  std::vector<std::string> lines;
  for (const Hdf5Object& dataset : datasets) {
    if (lines.size() == kMostListed) break;
    lines.push_back(fmt::format("'{}' ({})", dataset.path, dataset.array->described()));
  }
  std::string text = fmt::format("{}", fmt::join(lines, ", "));
  if (datasets.size() > kMostListed) text += fmt::format(" and {} more", datasets.size() - kMostListed);
  return text;
}

// Of the datasets of a file the one that is a volume.
std::string onlyVolume(Hdf5File& file) {
  const std::vector<Hdf5Object> all = file.datasets();
  struct Bounds {
    std::size_t fewest;
    std::size_t most;
  };
  for (const Bounds& bounds : {Bounds{3, 5}, Bounds{2, 2}}) {
    std::vector<Hdf5Object> found;
    std::ranges::copy_if(all, std::back_inserter(found), [&](const Hdf5Object& dataset) {
      const std::size_t axes = longAxes(*dataset.array);
      return dataset.array->format && axes >= bounds.fewest && axes <= bounds.most;
    });
    if (found.size() == 1) return found.front().path;
    if (found.size() > 1) {
      failData("{}: holds several datasets; choose one with --dataset PATH: {}", file.name(), listedDatasets(found));
    }
  }
  failData("{}: holds no dataset of numbers with 2 to 5 axes{}{}", file.name(), all.empty() ? "" : "; there is ",
           listedDatasets(all));
}

// Of an axis that maps of the earth have.
std::string usualName(const std::string& name) {
  static constexpr std::pair<std::string_view, char> kOthers[] = {
      {"lon", 'x'},   {"longitude", 'x'}, {"lat", 'y'},    {"latitude", 'y'}, {"lev", 'z'},
      {"level", 'z'}, {"depth", 'z'},     {"height", 'z'}, {"altitude", 'z'}};
  for (const auto& [other, usual] : kOthers) {
    if (name == other) return std::string(1, usual);
  }
  return name;
}

// As ilastik's axes, netCDF's scales or labels of dimensions name them; none where they are not named, or none is x.
std::vector<std::string> axisNames(const Hdf5Object& dataset) {
  std::vector<std::string> names;
  if (const auto tags = dataset.text("axistags")) {
    const auto said = nlohmann::json::parse(*tags, nullptr, false);
    if (said.is_object() && said.contains("axes") && said.at("axes").is_array()) {
      for (const nlohmann::json& axis : said.at("axes")) {
        const bool has_key = axis.is_object() && axis.contains("key") && axis.at("key").is_string();
        names.push_back(has_key ? axis.at("key").get<std::string>() : std::string());
      }
    }
  }
  if (names.empty()) names = dataset.texts("DIMENSION_LABELS");
  if (names.empty()) {
    for (const std::string& path : dataset.texts("DIMENSION_LIST")) names.push_back(path.substr(path.rfind('/') + 1));
  }
  for (std::string& name : names) name = usualName(lowerCase(name));
  if (names.size() != dataset.array->rank() || std::ranges::find(names, "x") == names.end()) return {};
  return names;
}

bool mayBeChannels(std::uint64_t size) { return size >= 2 && size <= kMaxChannels; }

// Axes without names: z, y, x, and of four one that is of channels where it is as short as that, else of frames.
ArrayPart partByShape(const Hdf5Array& array, const std::string& name, const ImportOptions& options,
                      std::vector<std::string>& notes) {
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < array.rank(); ++axis) axes.push_back(axis);
  // Axes of length 1 are none, where there are more than three: those in front first.
  while (axes.size() > 3 && array.shape[axes.front()] == 1) axes.erase(axes.begin());
  while (axes.size() > 3 && array.shape[axes.back()] == 1) axes.pop_back();
  ArrayPart part;
  part.index.assign(array.rank(), 0);
  if (axes.size() > 4) {
    failData("{}: has {} axes that are longer than 1 and not named; a volume has 3, with channels or frames 4", name,
             axes.size());
  }
  if (axes.size() == 4 && mayBeChannels(array.shape[axes.back()])) {
    part.channel = axes.back();
    axes.pop_back();
  } else if (axes.size() == 4 && mayBeChannels(array.shape[axes.front()]) && !options.choosesStep()) {
    part.channel = axes.front();
    axes.erase(axes.begin());
  } else if (axes.size() == 4) {
    const auto frames = static_cast<std::int64_t>(std::min<std::uint64_t>(array.shape[axes.front()], INT64_MAX));
    if (frames == 0) failData("{}: is empty: {}", name, array.described());
    part.index[axes.front()] = chosenFrame(options, frames, name, "shape", notes);
    axes.erase(axes.begin());
  }
  if (part.channel) {
    notes.push_back(fmt::format("of the axes of {}, which are not named, number {} is taken for channels",
                                array.described(), *part.channel));
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(axes.size(), 3); ++i) part.space[i] = axes[axes.size() - 1 - i];
  return part;
}

ArrayPart partByNames(const Hdf5Array& array, const std::vector<std::string>& names, const std::string& name,
                      const ImportOptions& options, std::vector<std::string>& notes) {
  std::vector<OmeAxis> axes;
  for (const std::string& axis : names) axes.push_back({.name = axis});
  OmeRoles roles = rolesOf(axes, name);
  // A scale of some other name, of pressure say, is what is left for z: the one axis that is longer than 1.
  const std::vector<std::size_t> others = roles.others(array.shape);
  const auto free = std::ranges::find_if(roles.part.space, [](const auto& axis) { return !axis.has_value(); });
  if (others.size() == 1 && free != roles.part.space.end()) {
    notes.push_back(fmt::format("axis '{}' is taken for {}", names[others[0]], "xyz"[free - roles.part.space.begin()]));
    *free = others[0];
  }
  if (roles.time) {
    roles.part.index[*roles.time] = chosenStep(options, array.shape[*roles.time], name, notes);
  }
  for (const std::size_t axis : roles.others(array.shape)) {
    notes.push_back(fmt::format("of axis '{}' with {} places it is the first", names[axis], array.shape[axis]));
  }
  return roles.part;
}

void setSizes(const Hdf5Array& array, const std::string& name, ArrayPart& part, std::vector<std::string>& notes) {
  setPartSizes(array.shape, name, part, notes);
  for (const std::uint64_t size : array.shape) {
    if (size == 0) failData("{}: is empty: {}", name, array.described());
  }
}

// Scales of netCDF, sizes of ilastik's axes or of Fiji's elements.
void setPlace(Hdf5File& file, const Hdf5Object& dataset, const ArrayPart& part, Hdf5Image& image) {
  std::array<std::optional<AxisScale>, 3> scales;
  const std::vector<double> sizes_um = dataset.numbers("element_size_um");
  const std::vector<std::string> lists = dataset.texts("DIMENSION_LIST");
  const auto tags = dataset.text("axistags");
  const auto said = nlohmann::json::parse(tags.value_or(""), nullptr, false);
  for (std::size_t i = 0; i < 3; ++i) {
    if (sizes_um.size() == 3) {
      const double step = sizes_um[2 - i];
      if (std::isfinite(step) && step > 0) scales[i] = AxisScale{.first = 0.5 * step, .step = step, .unit = "um"};
    } else if (part.space[i] && lists.size() == dataset.array->rank() && !lists[*part.space[i]].empty()) {
      scales[i] = readScale(file, lists[*part.space[i]], dataset.array->shape[*part.space[i]], image.notes);
    } else if (part.space[i] && said.is_object() && said.contains("axes") && said.at("axes").is_array() &&
               said.at("axes").size() == dataset.array->rank()) {
      const nlohmann::json& axis = said.at("axes").at(*part.space[i]);
      const double step =
          axis.is_object()
              ? axis.value("resolution", nlohmann::json(0)).is_number() ? axis.value("resolution", 0.0) : 0.0
              : 0.0;
      if (std::isfinite(step) && step > 0) scales[i] = AxisScale{.first = 0.5 * step, .step = step};
    }
  }
  const bool has_tags = lists.size() != dataset.array->rank();
  placeByScales(scales, part,
                sizes_um.size() == 3 ? "element_size_um"
                : has_tags           ? "axistags"
                                     : "DIMENSION_LIST",
                image);
}

// The conventions of netCDF: what values are in their unit, and which one says that there is none.
void setValues(const Hdf5Object& dataset, const ArrayPart& part, Hdf5Image& image) {
  SourceChannel said;
  const auto scale = dataset.number("scale_factor");
  const auto offset = dataset.number("add_offset");
  if (scale && std::isfinite(*scale) && *scale != 0) said.value_scale = *scale;
  if (offset && std::isfinite(*offset)) said.value_offset = *offset;
  if (const auto unit = dataset.text("units"); unit && unit->size() <= kMaxUnitBytes) said.unit = *unit;
  for (const char* name : {"_FillValue", "missing_value"}) {
    const auto missing = dataset.number(name);
    if (!missing || std::isnan(*missing)) continue;
    image.notes.push_back(
        fmt::format("{} is where there is no value ({})", said.value_offset + said.value_scale * *missing, name));
    break;
  }
  image.channels.assign(part.channels, said);
}

}  // namespace

std::uint64_t chosenLevel(const ImportOptions& options, std::uint64_t levels, const std::string& name) {
  const auto level = static_cast<std::uint64_t>(options.level.value_or(0));
  if (level >= levels) failData("{}: level {} is asked for, must be 0..{}", name, level, levels - 1);
  return level;
}

ArrayPart plainPart(const Hdf5Array& array, const std::string& name) {
  if (array.rank() < 2 || array.rank() > 3) failData("{}: is {}; it must have 2 or 3 axes", name, array.described());
  ArrayPart part;
  part.index.assign(array.rank(), 0);
  for (std::size_t i = 0; i < array.rank(); ++i) part.space[i] = array.rank() - 1 - i;
  std::vector<std::string> none;
  setSizes(array, name, part, none);
  return part;
}

Hdf5Image imageOfDataset(Hdf5File& file, const Hdf5Object& dataset, const ImportOptions& options,
                         std::vector<std::string> names) {
  const std::string name = fmt::format("{}: '{}'", file.name(), dataset.path);
  const Hdf5Array& array = *dataset.array;
  if (array.rank() < 2) failData("{}: is {}; a volume has 2 axes and more", name, array.described());
  if (options.level.value_or(0) != 0) failData("{}: level {} is asked for, it is one level", name, *options.level);
  Hdf5Image image;
  if (names.empty()) names = axisNames(dataset);
  ArrayPart part = names.empty() ? partByShape(array, name, options, image.notes)
                                 : partByNames(array, names, name, options, image.notes);
  setSizes(array, name, part, image.notes);
  setPlace(file, dataset, part, image);
  setValues(dataset, part, image);
  image.datasets.push_back({.path = dataset.path, .array = array, .part = std::move(part)});
  return image;
}

Hdf5Image findPlain(Hdf5File& file, const ImportOptions& options) {
  const std::string path = options.dataset ? *options.dataset : onlyVolume(file);
  const auto object = file.object(path);
  if (!object || !object->array) {
    const std::vector<Hdf5Object> all = file.datasets();
    failData("{}: --dataset '{}' is {}; there {}", file.name(), path, object ? "a group" : "not there",
             all.empty() ? "are none" : fmt::format("is {}", listedDatasets(all)));
  }
  return imageOfDataset(file, *object, options);
}

}  // namespace blockwalk
