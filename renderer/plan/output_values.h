// SPDX-License-Identifier: Apache-2.0
// The numbers of outputs other than color (docs/integration.md, "Outputs"), from the words that the kernel writes. It
// gives one float a pixel, t of the point shown; depth and world position are made of it in double.
#pragma once

#include <span>

#include "view/frame.h"
#include "view/resolved_view.h"

namespace blockwalk {

class OutputValues {
 public:
  OutputValues(const ResolvedView& view, const VolumeInfo& info);

  // Sizes the frame's pixels or values for the view's output; values hold nothing.
  void prepare(Frame& frame) const;
  // The values of the rows from `row` on, from their words.
  void fromWords(std::span<const std::uint32_t> words, int row, Frame& frame) const;

 private:
  double depthOf(float t, glm::dvec2 slope) const;
  glm::dvec2 slopeOf(int column, int row) const;
  glm::dvec3 pointAt(double depth, glm::dvec2 slope) const;

  ResolvedView view_;
  Camera camera_;
  WorldBox box_;
  glm::dvec2 depth_range_{0};  // of the volume's box, before the eye
  double anchor_depth_ = 0;
};

}  // namespace blockwalk
