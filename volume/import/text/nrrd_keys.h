// SPDX-License-Identifier: Apache-2.0
// The keys of this project's own in a NRRD header: what volume/export has to say and the format has no field for.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "volume/source.h"

namespace blockwalk {

constexpr std::string_view kNrrdKeyPrefix = "blockwalk.";

struct NrrdKeys {
  std::string space;  // empty where it is not said, as all of these
  std::string length_unit;
  std::optional<glm::dvec3> corner;     // of index (0, 0, 0) in the world
  std::vector<SourceChannel> channels;  // the values are maps from the file's samples
};

// `keys`: without the prefix, with their values as they stand. Keys that are not known say nothing. Throws DataError
// naming `source`, the key and the bound.
NrrdKeys readNrrdKeys(const std::map<std::string, std::string>& keys, std::size_t channels, const std::string& source);

}  // namespace blockwalk
