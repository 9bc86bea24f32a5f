// SPDX-License-Identifier: Apache-2.0
// What the axes of world space are called, and on which side they lie.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace blockwalk {

struct WorldSpace {
  std::string name;             // of the right-handed space
  bool is_left_handed = false;  // as it was said: its first axis is turned round to give `name`
  // From `name` to the right, to the front and up; nothing where it does not say how these lie.
  std::optional<glm::dmat3> ras_from_space = std::nullopt;
};

// The spaces of NRRD, their short names (RAS, LPS) and all others that say right or left, anterior or posterior and
// superior or inferior in some order; with `-time` or without. What is none of these is right-handed and keeps its
// name.
WorldSpace worldSpace(std::string_view said);

}  // namespace blockwalk
