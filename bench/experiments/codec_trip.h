// SPDX-License-Identifier: Apache-2.0
// What a lossy codec leaves of a picture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocol/image_codec.h"

namespace blockwalk::bench {

struct CodecTrip {
  std::vector<std::uint32_t> pixels;  // as decoded: straight rgba8, red lowest
  std::size_t bytes = 0;              // of the file
  double encode_ms = 0;               // median of the repeats
};

// Encodes `repeats` times, at least once, and decodes. `format` is jpeg or webp. Throws DataError where what was
// written cannot be read.
CodecTrip throughCodec(const Frame& frame, ImageFormat format, int quality, int repeats);

}  // namespace blockwalk::bench
