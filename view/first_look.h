// SPDX-License-Identifier: Apache-2.0
// From where a volume is first seen.
#pragma once

#include <glm/glm.hpp>
#include <string>

namespace blockwalk {

struct FirstLook {
  glm::dvec3 up{0, 1, 0};        // world
  glm::dvec3 from{1, 0.8, 1.2};  // world, from what is looked at towards the eye; of any length
};

// `space` is what the axes of world space are (Metadata::space). Where they are a patient's, the head is up, and he is
// seen from the front, a little from his left and above; all other spaces are seen along their own axes.
FirstLook firstLook(const std::string& space);

}  // namespace blockwalk
