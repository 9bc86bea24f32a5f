// SPDX-License-Identifier: Apache-2.0
// Two-sided Blinn-Phong light (Blinn 1977) as docs/integration.md gives it.
#pragma once

#include <glm/glm.hpp>

#include "tests/reference/dense_volume.h"
#include "tests/reference/ray.h"
#include "view/view.h"

namespace blockwalk::reference {

// What a surface of this colour and gradient (index space of the volume's level) sends back along the ray. May exceed
// 1; where the gradient is zero it is the colour itself.
glm::dvec3 shade(const DenseVolume& volume, const View& view, const Ray& world_ray, glm::dvec3 color,
                 glm::dvec3 gradient_index);

}  // namespace blockwalk::reference
