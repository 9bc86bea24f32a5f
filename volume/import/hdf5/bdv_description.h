// SPDX-License-Identifier: Apache-2.0
// The XML file of BigDataViewer (SpimData): which views there are, and where they lie.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

// What is one image at each time: a channel of an angle of a tile under an illumination.
struct BdvSetup {
  int id = 0;
  std::string name = {};
  std::optional<glm::dvec3> voxel_size = {};  // x, y, z
  std::string unit = {};
  std::string channel = {};  // its name, else its number
  std::string place = {};    // all other attributes: setups on one grid have the same
  std::optional<std::array<std::uint8_t, 3>> color = {};
};

struct BdvDescription {
  std::string file = {};              // for messages
  std::string data = {};              // the HDF5 file's name, from the folder of this one
  bool is_absolute = false;           // that the name was given with folders, of which it is the last part
  std::vector<BdvSetup> setups = {};  // by their numbers
  std::map<std::pair<int, int>, glm::dmat4> world;  // by time and setup: from centres of voxels, counted from 0

  const BdvSetup* setup(int id) const;
};

// Throws DataError naming the file and what is wrong: other images than HDF5's, maps that are not of 12 numbers.
BdvDescription readBdvDescription(const InputFile& file);

}  // namespace blockwalk
