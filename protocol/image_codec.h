// SPDX-License-Identifier: Apache-2.0
// A frame's pixels as bytes of an image format.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/view_fields.h"
#include "view/frame.h"

namespace blockwalk {

// png: RGB when every pixel is opaque, else RGBA, straight; lossless, tuned for speed (zlib, runs only).
// jpeg: `quality` 1..100; 4:4:4 from quality 90 on, else 4:2:0. It has no opacity: the
// frame is composited over black.
// webp: `quality` 1..99 lossy, 4:2:0, with the opacity as it is; 100 lossless, every pixel as it is, also the colour of
// one without opacity. Encoding takes about 8 bytes of memory a pixel, lossless 24.
// raw: rows of rgba8, width * height * 4 bytes.
//
// Where the output is not color: raw is rows of Frame::values, f32 little endian; the others hold what
// output_picture.h makes of them, depth and value as 16-bit grey in png and 8-bit grey in jpeg and webp.
//
// The frame must be complete (pixels = width * height, sides 1..8192). Throws DataError when the codec refuses, and for
// a quality that is not 1..100.
std::vector<std::byte> encodeImage(const Frame& frame, ImageFormat format, int quality);

// The same bytes as format raw, where they lie in the frame.
std::span<const std::byte> rawBytes(const Frame& frame);

std::string_view imageMimeType(ImageFormat format);
std::string_view imageFormatName(ImageFormat format);  // as in a view's `format`

// What a pixel of `raw` holds.
struct RawPixel {
  int channels = 4;
  std::string_view type = "u8";  // u8 or f32
};
RawPixel rawPixel(Output output);

}  // namespace blockwalk
