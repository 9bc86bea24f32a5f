// SPDX-License-Identifier: Apache-2.0
// What the axes of world space are called, and on which side they lie.
#pragma once

#include <string>
#include <string_view>

namespace blockwalk {

struct WorldSpace {
  std::string name;             // of the right-handed space
  bool is_left_handed = false;  // as it was said: its first axis is turned round to give `name`
};

// The spaces of NRRD, their short names (RAS, LPS) and all others that say right or left, anterior or posterior and
// superior or inferior in some order; with `-time` or without. What is none of these is right-handed and keeps its
// name.
WorldSpace worldSpace(std::string_view said);

}  // namespace blockwalk
