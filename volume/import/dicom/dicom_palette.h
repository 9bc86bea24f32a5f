// SPDX-License-Identifier: Apache-2.0
// The colours of PALETTE COLOR pixels (PS3.3, C.7.6.3.1.5 and C.7.9).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "volume/import/dicom/dicom_set.h"

namespace blockwalk {

// As the file has it; tables of segments take little there and much here, so they are expanded when they are used.
struct DicomPalette {
  int entries = 0;
  int first =
      0;  // value whose colour is the first entry; what is below has it too, and what is beyond the last the last
  int bits = 8;  // of an entry: 8 or 16
  bool is_segmented = false;
  bool is_big_endian = false;
  std::array<std::string, 3> tables;
  bool operator==(const DicomPalette&) const = default;
};

// `is_signed`: pixels are. Throws DataError naming the element and the bound.
std::shared_ptr<const DicomPalette> readDicomPalette(const DicomFile& file, bool is_signed);

// Red, green and blue by entry. Throws DataError where a table is too short or has another number of entries.
std::vector<std::uint16_t> expandPalette(const DicomPalette& palette, const std::string& name);

}  // namespace blockwalk
