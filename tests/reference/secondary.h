// SPDX-License-Identifier: Apache-2.0
// Light that does not reach what a pixel shows (docs/integration.md, "Shadow and ambient occlusion"), and the lens.
#pragma once

#include "tests/reference/modes.h"

namespace blockwalk::reference {

// The view with what is left of its key and its ambient light at the point that the ray shows. Adds to the pixel's
// distances and margins those of the rays that are sent from there. `sample`: of the pixel's.
View withLightThatComes(const Scene& scene, const CutRay& cut, int sample, Pixel& pixel);

// A place on a lens of radius 1, to the right and up, of a pixel's sample.
glm::dvec2 placeOnLens(int x, int y, int sample);

}  // namespace blockwalk::reference
