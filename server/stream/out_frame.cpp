// SPDX-License-Identifier: Apache-2.0
#include "server/stream/out_frame.h"

#include <utility>

#include "protocol/image_codec.h"
#include "protocol/stream_messages.h"

namespace blockwalk {

OutFrame outFrame(const PaceStep& step, ImageFormat format, MadeFrame made, std::uint64_t seq,
                  std::uint64_t dropped_views) {
  std::optional<FramePages> pages;
  if (made.stats.paged) {
    pages = FramePages{.wanted_blocks = made.stats.wanted_blocks,
                       .absent_blocks = made.stats.absent_blocks,
                       .pages_read = made.stats.pages_read,
                       .failure = made.stats.page_failure};
  }
  const FrameHeader header{.id = step.id,
                           .seq = seq,
                           .width = made.width,
                           .height = made.height,
                           .format = std::string(imageFormatName(format)),
                           .level = made.stats.level,
                           .final = step.is_last,
                           .complete = made.stats.isComplete(),
                           .pages = pages,
                           .scale = step.scale,
                           .samples = step.samples_end,
                           .gpu_ms = made.stats.gpu_ms,
                           .encode_ms = made.encode_ms,
                           .dropped = dropped_views,
                           .drawn_pixels = made.stats.drawn_pixels,
                           .reasons = made.stats.reasons};
  return {.head = frameHead(header),
          .image = std::move(made.image),
          .text_after = step.is_last ? statsMessage(step.id, seq, made.stats) : std::string(),
          .room = std::move(made.room)};
}

}  // namespace blockwalk
