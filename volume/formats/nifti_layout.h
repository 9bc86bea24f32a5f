// SPDX-License-Identifier: Apache-2.0
// Where the fields of a NIfTI header lie, in bytes (nifti1.h, nifti2.h).
#pragma once

#include <cstddef>
#include <cstdint>

namespace blockwalk {

constexpr std::int32_t kNifti1Bytes = 348;
constexpr std::int32_t kNifti2Bytes = 540;

struct NiftiLayout {
  std::size_t datatype, dim, pixdim, vox_offset, slope, qform_code, sform_code, quaternion, offset, srow, units, intent;
};
constexpr NiftiLayout kNifti1Layout{70, 40, 76, 108, 112, 252, 254, 256, 268, 280, 123, 68};
constexpr NiftiLayout kNifti2Layout{12, 16, 104, 168, 176, 344, 348, 352, 376, 400, 500, 504};

constexpr int kNiftiLabelIntent = 1002;

}  // namespace blockwalk
