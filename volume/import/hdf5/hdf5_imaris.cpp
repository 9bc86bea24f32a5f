// SPDX-License-Identifier: Apache-2.0
// Imaris 5 and later: https://imaris.oxinst.com/support/imaris-file-format
#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "volume/error.h"
#include "volume/formats/length_unit.h"
#include "volume/import/hdf5/hdf5_image.h"
#include "volume/import/header_text.h"
#include "volume/plain_text.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

// Members "NAME 0", "NAME 1" and so on that are there one after the other.
std::uint64_t numbered(const Hdf5Object& group, std::string_view name) {
  std::uint64_t count = 0;
  while (count < group.members.size() && group.has(fmt::format("{} {}", name, count))) ++count;
  return count;
}

std::vector<double> realsIn(const std::string& text) {
  std::vector<double> reals;
  for (const std::string_view word : words(text)) {
    if (const auto real = parseReal(word)) reals.push_back(*real);
  }
  return reals;
}

// Where it cuts off what chunks were filled up with.
ArrayPart partOf(const Hdf5Object& channel, const Hdf5Object& data, const std::string& name,
                 std::vector<std::string>& notes) {
  if (!data.array || data.array->rank() != 3) failData("{}: must be a dataset with 3 axes", name);
  ArrayPart part = plainPart(*data.array, name);
  std::array<std::int64_t, 3> sizes{part.dims.x, part.dims.y, part.dims.z};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string field = fmt::format("ImageSize{}", "XYZ"[i]);
    const std::string said = channel.joined(field);
    const auto size = parseInteger(said);
    if (said.empty()) {
      notes.push_back(fmt::format("{} is not said: it is the dataset's", field));
      continue;
    }
    if (!size || *size < 1 || *size > sizes[i]) {
      failData("{}: {} is '{}', must be 1..{}", name, field, said, sizes[i]);
    }
    sizes[i] = *size;
  }
  part.dims = checkedDims(sizes[0], sizes[1], sizes[2], name, "ImageSize");
  return part;
}

SourceChannel describedBy(const Hdf5Object& info) {
  SourceChannel channel;
  std::string name(trimmed(info.joined("Name")));
  if (name == "(name not specified)") name.clear();
  while (name.size() > kMaxChannelNameBytes) name.pop_back();
  channel.name = plainText(name);
  const std::vector<double> color = realsIn(info.joined("Color"));
  const bool is_base_color = info.joined("ColorMode") != "TableColor";
  if (is_base_color && color.size() == 3 &&
      std::ranges::all_of(color, [](double part) { return part >= 0 && part <= 1; })) {
    channel.color = {static_cast<std::uint8_t>(std::lround(255 * color[0])),
                     static_cast<std::uint8_t>(std::lround(255 * color[1])),
                     static_cast<std::uint8_t>(std::lround(255 * color[2]))};
  }
  const std::vector<double> range = realsIn(info.joined("ColorRange"));
  if (range.size() == 2 && std::isfinite(range[0]) && std::isfinite(range[1]) && range[0] < range[1]) {
    channel.window = {range[0], range[1]};
  }
  return channel;
}

// The box that all voxels fill, whatever the level.
void placeIn(const Hdf5Object& info, glm::ivec3 dims, Hdf5Image& image) {
  glm::dvec3 low{0};
  glm::dvec3 step{1};
  for (int i = 0; i < 3; ++i) {
    const auto begin = parseReal(info.joined(fmt::format("ExtMin{}", i)));
    const auto end = parseReal(info.joined(fmt::format("ExtMax{}", i)));
    if (!begin || !end || !std::isfinite(*begin) || !std::isfinite(*end) || !(*end > *begin)) {
      image.notes.push_back(fmt::format("ExtMin{} and ExtMax{} are no extent: steps are 1", i, i));
      return;
    }
    low[i] = *begin;
    step[i] = (*end - *begin) / dims[i];
  }
  image.geometry.axes = {glm::dvec3(step.x, 0, 0), glm::dvec3(0, step.y, 0), glm::dvec3(0, 0, step.z)};
  image.geometry.first_center = low + 0.5 * step;
  image.geometry.corner = low;
  image.spacing_fields = "ExtMin, ExtMax";
  image.length_unit = lengthUnit(info.joined("Unit")).name;
}

// All channels up to the fourth, or the one that --dataset names by its group or its own name.
std::vector<std::uint64_t> chosenChannels(Hdf5File& file, const std::vector<SourceChannel>& channels,
                                          const ImportOptions& options, std::vector<std::string>& notes) {
  std::vector<std::uint64_t> chosen;
  if (!options.dataset) {
    for (std::uint64_t i = 0; i < std::min<std::uint64_t>(channels.size(), kMaxChannels); ++i) chosen.push_back(i);
    if (channels.size() > chosen.size()) {
      notes.push_back(fmt::format("of {} channels it has the first {}; --dataset \"Channel N\" chooses one by itself",
                                  channels.size(), chosen.size()));
    }
    return chosen;
  }
  for (std::uint64_t i = 0; i < channels.size(); ++i) {
    const bool is_it = *options.dataset == fmt::format("Channel {}", i) || *options.dataset == channels[i].name;
    if (is_it) return {i};
  }
  failData("{}: --dataset '{}' is no dataset and none of Channel 0..{}", file.name(), *options.dataset,
           channels.size() - 1);
}

}  // namespace

std::optional<Hdf5Image> findImaris(Hdf5File& file, const Hdf5Object& root, const ImportOptions& options) {
  const auto named = [&](const char* attribute, const std::string& usual) {
    const std::string name = root.joined(attribute);
    return name.empty() ? usual : name;
  };
  const std::string data_folder = named("DataSetDirectoryName", "DataSet");
  const std::string info_folder = named("DataSetInfoDirectoryName", "DataSetInfo");
  if (!root.has(data_folder)) return std::nullopt;
  const auto data = file.object(data_folder);
  const std::uint64_t levels = data ? numbered(*data, "ResolutionLevel") : 0;
  if (levels == 0) return std::nullopt;

  Hdf5Image image;
  const std::uint64_t level = chosenLevel(options, levels, file.name());
  const auto level_group = file.object(hdf5Path(data_folder, fmt::format("ResolutionLevel {}", level)));
  const std::uint64_t steps = level_group ? numbered(*level_group, "TimePoint") : 0;
  const std::uint64_t step = chosenStep(options, steps, file.name(), image.notes);
  const auto group = file.object(hdf5Path(level_group->path, fmt::format("TimePoint {}", step)));
  const std::uint64_t count = group ? numbered(*group, "Channel") : 0;
  if (count == 0) failData("{}: '{}' has no channels", file.name(), level_group->path);
  std::vector<SourceChannel> channels(count);
  for (std::uint64_t i = 0; i < std::min<std::uint64_t>(count, 64); ++i) {
    if (const auto info = file.object(hdf5Path(info_folder, fmt::format("Channel {}", i)))) {
      channels[i] = describedBy(*info);
    }
  }
  for (const std::uint64_t i : chosenChannels(file, channels, options, image.notes)) {
    const auto channel = file.object(hdf5Path(group->path, fmt::format("Channel {}", i)));
    const auto voxels = channel ? file.object(hdf5Path(channel->path, "Data")) : std::nullopt;
    const std::string name = fmt::format("{}: '{}/Channel {}/Data'", file.name(), group->path, i);
    if (!voxels || !voxels->array) failData("{}: is not there", name);
    image.datasets.push_back(
        {.path = voxels->path, .array = *voxels->array, .part = partOf(*channel, *voxels, name, image.notes)});
    image.channels.push_back(channels[i]);
  }
  if (const auto info = file.object(hdf5Path(info_folder, "Image"))) {
    placeIn(*info, image.datasets.front().part.dims, image);
  } else {
    image.notes.push_back("where it lies is not said: steps are 1");
  }
  return image;
}

}  // namespace blockwalk
