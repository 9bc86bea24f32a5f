// SPDX-License-Identifier: Apache-2.0
// A frame's pixels as bytes of an image format.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "protocol/view_fields.h"
#include "renderer/renderer.h"

namespace blockwalk {

// png: RGB when every pixel is opaque, else RGBA, straight; lossless, tuned for speed (zlib level 2).
// jpeg: `quality` 1..100; 4:4:4 from quality 90 on, else 4:2:0. It has no opacity: the
// frame is composited over black.
// raw: rows of rgba8, width * height * 4 bytes.
// The frame must be complete (pixels = width * height, sides 1..8192). Throws DataError when the codec refuses.
std::vector<std::byte> encodeImage(const Frame& frame, ImageFormat format, int quality);

std::string_view imageMimeType(ImageFormat format);
std::string_view imageFormatName(ImageFormat format);  // as in a view's `format`

}  // namespace blockwalk
