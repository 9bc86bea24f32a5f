// SPDX-License-Identifier: Apache-2.0
#include "renderer/band_part.h"

#include <algorithm>

#include "shaders/kernel_interface.h"

namespace blockwalk {

bool BandPart::narrow() {
  if (part_.row_count > gpu::kGroupSide) {
    rows_ = part_.row_count = wholeGroups(part_.row_count / 2);
  } else if (part_.column_count > gpu::kGroupSide) {
    columns_ = part_.column_count = wholeGroups(part_.column_count / 2);
  } else {
    return false;
  }
  return true;
}

bool BandPart::next() {
  part_.column_begin += part_.column_count;
  const int columns_end = band_.column_begin + band_.column_count;
  if (part_.column_begin >= columns_end) {
    part_.column_begin = band_.column_begin;
    part_.row_begin += part_.row_count;
    part_.row_count = std::min(rows_, band_.row_begin + band_.row_count - part_.row_begin);
  }
  part_.column_count = std::min(columns_, columns_end - part_.column_begin);
  return part_.row_count > 0;
}

}  // namespace blockwalk
