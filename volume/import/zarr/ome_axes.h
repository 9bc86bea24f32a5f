// SPDX-License-Identifier: Apache-2.0
// The axes of an image as OME-Zarr or plain Zarr say them, and the maps that it has between voxels and the world.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "volume/import/geometry.h"
#include "volume/import/zarr/zarr_array.h"
#include "volume/import/zarr/zarr_objects.h"

namespace blockwalk {

struct OmeAxis {
  std::string name = {};
  std::string type = {};  // space, time, channel; or empty
  std::string unit = {};
  std::string towards = {};  // anatomical: what the axis leads to, "left"
};

// Rows are axes of the world, columns axes of the array; the last column is the offset.
struct OmeMap {
  std::vector<std::vector<double>> rows;
  bool has_offset = false;  // that an offset is said: then voxels are placed by their centres

  static OmeMap identity(std::size_t rank);
  // What `transform` makes of where this map leads.
  void then(const OmeMap& transform);
};

// "scale", "translation", "affine", "rotation", "identity" and a "sequence" of them. Throws DataError for others.
OmeMap readOmeMap(const ZarrField& transform, std::size_t rank);

// Which axis is what. Where nothing is said, the last three are z, y, x.
struct OmeRoles {
  ArrayPart part;  // without dims and channels
  std::optional<std::size_t> time;
  // Those of `shape` that are none of these and longer than 1.
  std::vector<std::size_t> others(const std::vector<std::uint64_t>& shape) const;
};
OmeRoles rolesOf(const std::vector<OmeAxis>& axes, const std::string& file);

// Where the voxels lie, in the unit of the x axis, which it gives. Axes that the array lacks are as long as x.
struct OmePlace {
  Geometry geometry;
  std::string length_unit;
  std::string space;
};
OmePlace placeOf(const OmeMap& map, const std::vector<OmeAxis>& axes, const ArrayPart& part, const std::string& file);

}  // namespace blockwalk
