// SPDX-License-Identifier: Apache-2.0
#include "renderer/band_part.h"

#include <algorithm>

#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

int half(int pixels) { return (pixels / 2 + gpu::kGroupSide - 1) / gpu::kGroupSide * gpu::kGroupSide; }

}  // namespace

bool BandPart::narrow() {
  if (part_.row_count > gpu::kGroupSide) {
    rows_ = part_.row_count = half(part_.row_count);
  } else if (part_.column_count > gpu::kGroupSide) {
    columns_ = part_.column_count = half(part_.column_count);
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
