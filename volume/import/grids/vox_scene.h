// SPDX-License-Identifier: Apache-2.0
// MagicaVoxel's .vox: models, the palette, and the scene that they are placed in.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

// Voxels of all models that are shown, at places from 0 on.
struct VoxScene {
  glm::ivec3 dims{1};
  std::vector<std::uint64_t> places;  // (z * dims.y + y) * dims.x + x, ascending
  std::vector<std::uint8_t> colors;   // of each: an index of the palette, 1..255
  std::array<std::array<std::uint8_t, 4>, 256> palette{};
  std::vector<std::string> notes;
};

// `step`: of files that hold a model a step and no scene. Throws DataError naming the file, the chunk and the bound;
// takes no more than `memory_bytes`.
VoxScene readVoxScene(const InputFile& file, std::int64_t step, std::uint64_t memory_bytes);

}  // namespace blockwalk
