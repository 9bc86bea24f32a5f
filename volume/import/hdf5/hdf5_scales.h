// SPDX-License-Identifier: Apache-2.0
// Where voxels lie by lists of the places of each axis, as NeXus and netCDF have them.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "volume/import/hdf5/hdf5_image.h"

namespace blockwalk {

// Places of the samples along one axis that are one step apart.
struct AxisScale {
  double first = 0;
  double step = 1;
  std::string unit = {};
};

// Of a dataset of places for `count` samples, or for the edges between and around them. Nothing, and a note, where they
// are not one step apart or not as many.
std::optional<AxisScale> readScale(Hdf5File& file, const std::string& path, std::uint64_t count,
                                   std::vector<std::string>& notes);

// Sets place and unit from the scales of x, y and z, in the unit of the first that has one. A step that is not known is
// the mean of those that are, which is told. Nothing, and a note, where units cannot be turned into each other.
// `fields`: what the scales are from.
void placeByScales(const std::array<std::optional<AxisScale>, 3>& scales, const ArrayPart& part,
                   const std::string& fields, Hdf5Image& image);

}  // namespace blockwalk
