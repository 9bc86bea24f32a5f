// SPDX-License-Identifier: Apache-2.0
// Which of the grids of a file become a volume, and what they are in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "volume/import/import.h"
#include "volume/import/vdb/sparse_grid.h"
#include "volume/source.h"

namespace blockwalk {

constexpr std::size_t kMostGrids = 4096;  // of a file

// What a file says of a grid before its tree is read.
struct GridInfo {
  std::string name;     // plain; two may have one
  std::string type;     // of a value, as the file spells it
  std::string refusal;  // why it is not read; empty where it is
  SampleFormat format;  // of what is read of it
  bool is_level_set = false;
  bool has_points = false;           // and its values are how many there are in a voxel
  std::string grid_class;            // "fog volume"; empty where the file does not say it
  glm::dmat4 world_from_index{1.0};  // of voxel centres, which are whole numbers
  std::uint64_t active_voxels = 0;   // 0: not said
  std::uint64_t bytes = 0;           // in memory; 0: not said
  std::vector<std::pair<std::string, std::string>> facts;
};

// Reads the trees of some grids, by their places in the list.
using LoadGrids = std::function<std::vector<std::shared_ptr<const SparseGrid>>(const std::vector<std::size_t>& grids)>;

// A grid alone; two to four fields of one type and place as channels; a colour with its density as rgba8. Of others
// --dataset chooses one by its name or its number in the list, counted from 1. `info` has name, format and facts.
// Throws DataError naming the file, with the list where there is a choice to make.
std::unique_ptr<Source> openGrids(const std::vector<GridInfo>& grids, const LoadGrids& load, SourceInfo info,
                                  const ImportOptions& options);

}  // namespace blockwalk
