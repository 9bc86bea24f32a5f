// SPDX-License-Identifier: Apache-2.0
// What a stream shows: the newest view that was accepted, and what each step of the pace draws of it. No sockets.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "protocol/view_fields.h"
#include "server/render/frame_maker.h"
#include "server/stream/pace.h"
#include "view/resolved_view.h"

namespace blockwalk {

class StreamView {
 public:
  // With these members changed. Throws ViewError.
  StreamView with(const std::vector<std::pair<std::string, std::string>>& members, const VolumeInfo& info) const;

  StillPicture stillPicture() const;
  // The size and output of what a step draws.
  ViewChoices drawn(const PaceStep& step) const;
  // Format, quality and frame of a step; whose it is and of which volume is the caller's to say. `owner` is whose sums
  // a refinement goes on with.
  ImageOrder order(const PaceStep& step, const VolumeInfo& info, std::uint64_t owner) const;

 private:
  ImageRequest request_;
  ResolvedView view_;  // the request's
};

}  // namespace blockwalk
