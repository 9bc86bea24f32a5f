// SPDX-License-Identifier: Apache-2.0
#include "server/stream/stream_view.h"

#include <algorithm>
#include <cmath>

#include "protocol/image_codec.h"

namespace blockwalk {
namespace {

// Whether sums are kept between the steps of a refinement; else it has one step.
bool keepsSums(const ViewChoices& view) {
  return view.samples > 1 && std::int64_t{view.width} * view.height <= kMaxRefinedPixels;
}

int scaledSide(int side, double scale) { return std::max(1, static_cast<int>(std::lround(side * scale))); }

void shrink(ViewChoices& view, double scale) {
  view.width = scaledSide(view.width, scale);
  view.height = scaledSide(view.height, scale);
}

}  // namespace

StreamView StreamView::with(const std::vector<std::pair<std::string, std::string>>& members,
                            const VolumeInfo& info) const {
  StreamView changed;
  changed.request_ = request_;
  setViewFields(changed.request_, members);
  changed.view_ = resolveView(changed.request_.view, info);
  return changed;
}

StillPicture StreamView::stillPicture() const {
  const View& view = request_.view;
  return {.quality = request_.quality, .samples = view.samples, .in_steps = keepsSums(view)};
}

ViewChoices StreamView::drawn(const PaceStep& step) const {
  ViewChoices drawn = request_.view;
  if (step.kind == PaceStep::Kind::moving) shrink(drawn, step.scale);
  return drawn;
}

ImageOrder StreamView::order(const PaceStep& step, const VolumeInfo& info, std::uint64_t owner) const {
  ImageOrder order{.format = request_.format, .quality = step.quality};
  if (!step.is_last) {
    // JPEG is the quickest to make and send, but it has no opacity.
    const bool opaque = request_.view.background[3] == 255;
    if (request_.format == ImageFormat::png && opaque) order.format = ImageFormat::jpeg;
    // Lossless WebP takes several times as long as lossy.
    if (request_.format == ImageFormat::webp) order.quality = std::min(order.quality, kLosslessWebp - 1);
  }
  if (step.kind == PaceStep::Kind::still) {
    order.frame.view = view_;
    if (keepsSums(view_)) {
      order.frame.step = SampleStep{.owner = owner, .begin = step.samples_begin, .end = step.samples_end};
    }
    return order;
  }
  View small = request_.view;
  shrink(small, step.scale);
  small.samples = 1;
  order.frame.view = resolveView(small, info);
  order.frame.count = false;
  order.frame.as_it_is = true;
  return order;
}

}  // namespace blockwalk
