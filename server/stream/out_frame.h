// SPDX-License-Identifier: Apache-2.0
// A frame as a stream sends it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/render/frame_maker.h"
#include "server/stream/pace.h"

namespace blockwalk {

// The image stays where it is.
struct OutFrame {
  std::vector<std::byte> head;
  Bytes image;
  std::string text_after;      // is sent right after it, unless empty
  std::shared_ptr<void> room;  // held while the image is: see PixelRoom
};

// What a step of the pace made, as the stream's `seq`th frame, after which `dropped_views` were never shown.
OutFrame outFrame(const PaceStep& step, ImageFormat format, MadeFrame made, std::uint64_t seq,
                  std::uint64_t dropped_views);

}  // namespace blockwalk
