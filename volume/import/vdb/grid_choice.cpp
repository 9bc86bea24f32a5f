// SPDX-License-Identifier: Apache-2.0
#include "volume/import/vdb/grid_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include "volume/error.h"
#include "volume/import/header_text.h"
#include "volume/import/vdb/sparse_source.h"

namespace blockwalk {
namespace {

constexpr std::size_t kMostListed = 64;

bool isFloat(SampleType type) { return type == SampleType::f16 || type == SampleType::f32 || type == SampleType::f64; }

bool isColorName(const std::string& name) {
  const std::string lower = lowerCase(name);
  for (const std::string_view known : {"albedo", "cd", "color", "colour", "diffuse", "rgb", "scattering"}) {
    if (lower == known) return true;
  }
  return false;
}

// No voxel may be off by a thousandth of itself, as far out as voxels lie.
bool samePlace(const GridInfo& a, const GridInfo& b) {
  double least_step = HUGE_VAL;
  for (int i = 0; i < 3; ++i) least_step = std::min(least_step, glm::length(glm::dvec3(a.world_from_index[i])));
  for (int i = 0; i < 4; ++i) {
    const glm::dvec3 apart(a.world_from_index[i] - b.world_from_index[i]);
    const double most = i == 3 ? 1e-3 : 1e-3 / kMaxDim;
    if (!(glm::length(apart) <= most * least_step)) return false;
  }
  return true;
}

std::string listOf(const std::vector<GridInfo>& grids) {
  std::string list;
  for (std::size_t i = 0; i < grids.size() && i < kMostListed; ++i) {
    const GridInfo& grid = grids[i];
    list += fmt::format("\n  --dataset {}: {} of {}", i + 1, grid.name.empty() ? "(no name)" : grid.name, grid.type);
    if (!grid.grid_class.empty()) list += fmt::format(", {}", grid.grid_class);
    if (grid.active_voxels > 0) list += fmt::format(", {} active voxels", grid.active_voxels);
    if (!grid.refusal.empty()) list += fmt::format("; not read: {}", grid.refusal);
  }
  if (grids.size() > kMostListed) list += fmt::format("\n  and {} more", grids.size() - kMostListed);
  return list;
}

class GridChooser {
 public:
  GridChooser(const std::vector<GridInfo>& grids, const ImportOptions& options, SourceInfo& info)
      : grids_(grids), options_(options), info_(info) {}

  // A colour comes first, its density behind it.
  std::vector<std::size_t> choose() {
    if (grids_.empty()) failData("{}: holds no grid", info_.name);
    if (options_.dataset) return {named()};
    std::vector<std::size_t> usable;
    for (std::size_t i = 0; i < grids_.size(); ++i) {
      if (grids_[i].refusal.empty()) usable.push_back(i);
    }
    const bool passes_points = std::ranges::any_of(usable, [&](std::size_t i) { return !grids_[i].has_points; }) &&
                               std::erase_if(usable, [&](std::size_t i) { return grids_[i].has_points; }) > 0;
    if (usable.empty()) {
      failData("{}: grid '{}' of {}: {}{}", info_.name, grids_[0].name, grids_[0].type, grids_[0].refusal,
               grids_.size() > 1 ? "; none of the others is read either" : "");
    }
    if (usable.size() > 1 && !colorFirst(usable) && !areChannels(usable)) {
      failData("{}: holds {} grids that are not one volume; choose one:{}", info_.name, grids_.size(), listOf(grids_));
    }
    for (const GridInfo& grid : grids_) {
      const bool is_passed = passes_points && grid.has_points;
      if (grid.refusal.empty() && !is_passed) continue;
      info_.notes.push_back(fmt::format("grid '{}' of {} is passed over: {}", grid.name, grid.type,
                                        is_passed ? "it holds points, which --dataset chooses" : grid.refusal));
    }
    return usable;
  }

 private:
  std::size_t named() const {
    std::size_t i = 0;
    while (i < grids_.size() && *options_.dataset != grids_[i].name) ++i;
    if (i == grids_.size()) i = 0;  // no name of one: a number
    while (i < grids_.size() && *options_.dataset != grids_[i].name && *options_.dataset != fmt::format("{}", i + 1))
      ++i;
    if (i < grids_.size()) {
      if (grids_[i].refusal.empty()) return i;
      failData("{}: grid '{}' of {}: {}", info_.name, grids_[i].name, grids_[i].type, grids_[i].refusal);
    }
    failData("{}: --dataset {}: there is no such grid; there are{}", info_.name, *options_.dataset, listOf(grids_));
  }

  // Two grids, of which one is a colour by its type and name and the other one number a voxel.
  bool colorFirst(std::vector<std::size_t>& usable) const {
    if (usable.size() != 2 || !samePlace(grids_[usable[0]], grids_[usable[1]])) return false;
    const bool comes_second = grids_[usable[0]].format.channels == 1;
    const GridInfo& color = grids_[usable[comes_second ? 1 : 0]];
    const GridInfo& density = grids_[usable[comes_second ? 0 : 1]];
    if (color.format.channels != 3 || !isFloat(color.format.type) || !isColorName(color.name) ||
        density.format.channels != 1 || !isFloat(density.format.type)) {
      return false;
    }
    if (comes_second) std::swap(usable[0], usable[1]);
    return true;
  }

  bool areChannels(const std::vector<std::size_t>& usable) const {
    const GridInfo& first = grids_[usable[0]];
    return usable.size() <= kMaxChannels && std::ranges::all_of(usable, [&](std::size_t i) {
             const GridInfo& grid = grids_[i];
             return grid.format.channels == 1 && grid.format.type == first.format.type && samePlace(grid, first);
           });
  }

  const std::vector<GridInfo>& grids_;
  const ImportOptions& options_;
  SourceInfo& info_;
};

// Of floats that are a colour, what makes them 0..255: 1 is full, or where there are greater ones the greatest.
double colorScale(const SparseGrid& grid, int components, const std::string& name, std::vector<std::string>& notes) {
  const auto [least, greatest] = grid.range(0, components);
  const double full = std::max(greatest, 1.0);
  notes.push_back(fmt::format("grid '{}': its values are {:.6g}..{:.6g}; as a colour, 0..{:.6g} are 0..255", name,
                              least, greatest, full));
  return 255 / full;
}

void addColor(const GridInfo& info, const std::shared_ptr<const SparseGrid>& grid, SparseParts& parts,
              std::vector<std::string>& notes) {
  const double scale = colorScale(*grid, 3, info.name, notes);
  for (int i = 0; i < 3; ++i) parts.planes.push_back({.grid = 0, .component = i, .scale = scale});
  parts.is_color = true;
}

void addDensity(const GridInfo& info, const std::shared_ptr<const SparseGrid>& grid, SparseParts& parts,
                std::vector<std::string>& notes) {
  const auto [least, greatest] = grid->range(0, 1);
  const double full = greatest > 0 ? greatest : 1;
  notes.push_back(
      fmt::format("grid '{}': its values are {:.6g}..{:.6g}; as the density of the colours, 0..{:.6g} are "
                  "0..255, and what is above 0 is 1 at least",
                  info.name, least, greatest, full));
  parts.planes.push_back({.grid = 1, .component = 0, .scale = 255 / full, .keeps_some = true});
}

std::string componentName(const GridInfo& grid, int component) {
  constexpr std::array<std::string_view, 4> kColors{"r", "g", "b", "a"};
  constexpr std::array<std::string_view, 4> kAxes{"x", "y", "z", "w"};
  const auto& names = isColorName(grid.name) || grid.format.type == SampleType::u8 ? kColors : kAxes;
  const std::string_view name = names[static_cast<std::size_t>(component)];
  return grid.name.empty() ? std::string(name) : fmt::format("{}.{}", grid.name, name);
}

std::string channelName(std::string name) {
  // A letter of several bytes stays whole.
  std::size_t end = std::min(name.size(), kMaxChannelNameBytes);
  while (end < name.size() && end > 0 && (static_cast<unsigned char>(name[end]) & 0xc0) == 0x80) --end;
  name.resize(end);
  return name;
}

// What people should know of a grid that was read.
void noteGrid(const GridInfo& info, const SparseGrid& grid, std::vector<std::string>& notes) {
  if (info.is_level_set) {
    notes.push_back(
        fmt::format("grid '{}' is a level set: inside is density 1, in its narrow band a ramp down to 0", info.name));
  }
  if (info.has_points) {
    notes.push_back(fmt::format("grid '{}' holds points: values are how many of them lie in a voxel", info.name));
  }
  if (std::ranges::any_of(grid.background(), [](std::byte byte) { return byte != std::byte{0}; })) {
    notes.push_back(fmt::format(
        "grid '{}': what is not active has its background, which is not 0; unless that is empty (--empty), all of the "
        "box is stored",
        info.name));
  }
  if (grid.tileCount() > 0) {
    notes.push_back(fmt::format("grid '{}': {} of its {} active voxels lie in {} cubes of one value", info.name,
                                grid.voxelCount() - grid.leafVoxelCount(), grid.voxelCount(), grid.tileCount()));
  }
}

// Every component of every grid as it is.
void addFields(const std::vector<const GridInfo*>& grids, SparseParts& parts, const std::string& file) {
  for (std::size_t i = 0; i < grids.size(); ++i) {
    if (grids[i]->format.type != grids[0]->format.type) {
      failData("{}: channels: '{}' has values of {}, '{}' of {}; as fields they must be of one type", file,
               grids[0]->name, grids[0]->type, grids[i]->name, grids[i]->type);
    }
    for (int c = 0; c < grids[i]->format.channels; ++c) parts.planes.push_back({.grid = i, .component = c});
  }
  parts.is_color = grids[0]->format.channels > 1 && grids[0]->format.type == SampleType::u8;
}

void addFacts(const GridInfo& grid, SourceInfo& info) {
  constexpr std::size_t kMostBytes = 200;
  const auto add = [&](const std::string& key, const std::string& value) {
    if (!value.empty()) info.facts.emplace_back(key, value.substr(0, kMostBytes));
  };
  add("grid", grid.name);
  add("class", grid.grid_class);
  for (const auto& [key, value] : grid.facts) add(key, value);
}

}  // namespace

std::unique_ptr<Source> openGrids(const std::vector<GridInfo>& grids, const LoadGrids& load, SourceInfo info,
                                  const ImportOptions& options) {
  const std::vector<std::size_t> numbers = GridChooser(grids, options, info).choose();
  std::vector<const GridInfo*> chosen;
  for (const std::size_t number : numbers) chosen.push_back(&grids[number]);
  const GridInfo& first = *chosen[0];
  SparseParts parts;
  parts.grids = load(numbers);
  const bool may_be_color = first.format.channels == 3 && isFloat(first.format.type);
  if (may_be_color &&
      (options.channels == ChannelRule::color || (chosen.size() == 2 && options.channels != ChannelRule::fields))) {
    addColor(first, parts.grids[0], parts, info.notes);
    if (chosen.size() == 2) addDensity(*chosen[1], parts.grids[1], parts, info.notes);
  } else {
    addFields(chosen, parts, info.name);
  }
  info.channels.clear();
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const GridInfo& grid = *chosen[i];
    for (int c = 0; c < grid.format.channels; ++c) {
      info.channels.push_back({.name = channelName(grid.format.channels > 1 ? componentName(grid, c) : grid.name)});
    }
    noteGrid(grid, *parts.grids[i], info.notes);
  }
  if (options.dataset && grids.size() > 1) {
    info.notes.push_back(fmt::format("of {} grids it is '{}', by --dataset", grids.size(), first.name));
  }
  if (chosen.size() == 1) addFacts(first, info);
  info.world_from_index = first.world_from_index;
  return makeSparseSource(std::move(parts), std::move(info), options);
}

}  // namespace blockwalk
