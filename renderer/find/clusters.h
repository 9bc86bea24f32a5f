// SPDX-License-Identifier: Apache-2.0
// Boxes of active macrocells (Ganter & Manzke 2019, as Wald et al. 2021, 3, describe them).
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

namespace blockwalk {

// Cells lo..hi, hi excluded.
struct CellBox {
  glm::ivec3 lo{0};
  glm::ivec3 hi{0};
  bool operator==(const CellBox&) const = default;
};

// Greedily: the first active cell that is in no box grows a box along x, then y, then z, as far as all that it takes in
// is active and in no box. The boxes are disjoint and cover exactly the active cells. `states` is x fastest; a cell is
// active where it is kCellActive.
std::vector<CellBox> mergeCells(std::vector<std::uint8_t> states, glm::ivec3 dims);

}  // namespace blockwalk
