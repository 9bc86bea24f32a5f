// SPDX-License-Identifier: Apache-2.0
// Boxes of active macrocells (Ganter & Manzke 2019, as Wald et al. 2021, 3, describe them).
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

namespace blockwalk {

// Macrocells lo..hi, hi excluded.
struct MacrocellBox {
  glm::ivec3 lo{0};
  glm::ivec3 hi{0};
  bool operator==(const MacrocellBox&) const = default;
};

// Greedily: the first active macrocell that is in no box grows a box along x, then y, then z, as far as all that it
// takes in is active and in no box. The boxes are disjoint and cover exactly the active macrocells. `states` is x
// fastest; a macrocell is active where it is kMacrocellActive.
std::vector<MacrocellBox> mergeMacrocells(std::vector<std::uint8_t> states, glm::ivec3 dims);

}  // namespace blockwalk
