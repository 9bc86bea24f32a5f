// SPDX-License-Identifier: Apache-2.0
// The header of a NIfTI-1, NIfTI-2 or Analyze 7.5 file (nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h, nifti2.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "volume/import/convert/sample.h"
#include "volume/import/geometry.h"

namespace blockwalk {

struct NiftiHeader {
  SampleFormat format;  // of one volume; 3 or 4 samples: RGB24, RGBA32
  glm::ivec3 dims{1};
  std::int64_t frames = 1;  // volumes one after the other: the product of axes 4 to 7
  Geometry geometry;        // right-handed: to the right, to the front, up
  std::string length_unit;  // empty where it is not said
  std::string time_step;    // the same
  double value_scale = 1;   // value = offset + scale * sample
  double value_offset = 0;
  bool is_labels = false;        // by its intent
  bool is_single = true;         // the voxels follow the header; else they are in a file of their own
  std::uint64_t data_begin = 0;  // in the file of the voxels, unpacked
  std::vector<std::string> notes;
  std::string spacing_fields;  // that say it
};

constexpr std::size_t kNiftiHeaderBytes = 540;  // of the longest

// Whether a file begins with these bytes that is of one of the three. Analyze has no signature: its length and its
// fields say it.
bool startsLikeNifti(std::span<const std::byte> start);

// `start`: the first kNiftiHeaderBytes, or all that there are. Throws DataError naming `source`, the field and the
// bound.
NiftiHeader readNiftiHeader(std::span<const std::byte> start, const std::string& source);

}  // namespace blockwalk
