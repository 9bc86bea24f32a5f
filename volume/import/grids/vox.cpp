// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "volume/import/geometry.h"
#include "volume/import/grids/vox_source.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"

namespace blockwalk {

std::unique_ptr<Source> openVox(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  SourceInfo info{.name = file->name(), .format = "vox"};
  // There z leads up, in pictures y.
  Geometry upright;
  upright.axes = {glm::dvec3{1, 0, 0}, glm::dvec3{0, 0, -1}, glm::dvec3{0, 1, 0}};
  info.world_from_index = worldFromIndex(upright, options.spacing, info.name, "spacing");
  tellSpacing(options.spacing, "", info);
  VoxScene scene = readVoxScene(*file, options.frame.value_or(0), options.memory_bytes);
  return makeVoxSource(std::move(scene), std::move(info), options);
}

}  // namespace blockwalk
