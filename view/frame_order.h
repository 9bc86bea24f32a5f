// SPDX-License-Identifier: Apache-2.0
// What a frame is ordered with: the view, and how it is to be drawn. It goes unchanged from who asks to the renderer.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "view/resolved_view.h"

namespace blockwalk {

constexpr std::uint64_t kSumBytes = 16;  // of a pixel's sum of samples
// A picture of more pixels keeps no sums: a refinement should draw all its samples in one step.
constexpr std::int64_t kMaxRefinedPixels = (std::int64_t{256} << 20) / static_cast<std::int64_t>(kSumBytes);

// A step of a refinement: the same view is drawn several times, each time with more of its samples, and the sums of
// those drawn before are kept. The picture is bit for bit that of `end` samples drawn at once, also where the sums were
// lost, to memory or to another view, and all samples are drawn again.
struct SampleStep {
  std::uint64_t owner = 0;  // whose sums; each owner refines one view at a time
  int begin = 0;            // samples that the owner's last step of this view ended with; 0: this is its first
  int end = 1;              // greater than `begin`, at most the view's samples
};

struct FrameOrder {
  ResolvedView view{};
  bool count = true;   // fill the counters of RenderStats; off makes the kernel a little faster
  bool probe = false;  // fill Frame::probes
  // Of the view's picture, from the left and the top: draw this pixel alone, with the ray that it has there. The frame
  // has the size of a pixel.
  std::optional<glm::ivec2> pixel{};
  // Draw with the general kernel, which makes its late choices at run time: the same picture, slower. For measuring
  // what specialisation is worth.
  bool general = false;
  bool specialised = false;  // wait for the view's own kernel also with DeviceOptions::background_kernels
  // Build what clusters or boundary look for anew, as after a change of the range. For measuring what that takes.
  bool rebuild = false;
  // Make resident what the frame needs and draw nothing.
  bool prepare_only = false;
  // Where voxels come and go (docs/large.md): draw what is there, coarser where something is not, and wait for nothing.
  // Else the picture is drawn once all that it shows is there, as far as there is room for it.
  bool as_it_is = false;
  // Where voxels come and go: bring in what some rays of the view come to, as far as that needs nothing but room that
  // was not used of late, and draw nothing. For a view that may come next.
  bool ahead = false;
  // Any thread may set it; looked at between the pieces of the work. Null: never.
  std::shared_ptr<std::atomic<bool>> cancel{};
  std::optional<SampleStep> step{};  // none: all samples at once
};

}  // namespace blockwalk
