// SPDX-License-Identifier: Apache-2.0
// The numbers of outputs other than color (docs/integration.md, "Outputs"), from the words that the kernel writes. It
// gives one float a pixel, t of the point shown; depth and world position are made of it in double.
#pragma once

#include <functional>
#include <span>

#include "view/frame.h"
#include "view/resolved_view.h"

namespace blockwalk {

class OutputValues {
 public:
  // `finest`: the finest level that is drawn.
  OutputValues(const ResolvedView& view, const VolumeInfo& info, int finest);

  // Makes room for the frame's pixels, which are background, or values, which hold nothing.
  void prepare(Frame& frame) const;
  // The values of the rows from `row` on, from their words.
  void fromWords(std::span<const std::uint32_t> words, int row, Frame& frame) const;
  // Of a frame that has this pixel of the picture alone: its value, and where it is of a point, that. `level_at` has
  // the level at a depth; `hit` is the voxel that was hit, of the finest level drawn, -1 where that is not known.
  void fromWord(std::uint32_t word, glm::ivec2 pixel, const std::function<int(double depth)>& level_at,
                const Probe& hit, Frame& frame) const;
  // How many pixels of the frame are not background alone, or of numbers show something.
  std::uint64_t countDrawn(const Frame& frame) const;

 private:
  struct Aim {
    glm::dvec2 slope{0};
    std::size_t at = 0;  // the pixel in the frame
  };
  void putWord(std::uint32_t word, const Aim& aim, Frame& frame) const;
  bool showsPoint() const { return view_.output == Output::depth || view_.output == Output::position; }
  double depthOf(float t, glm::dvec2 slope) const;
  glm::dvec2 slopeOf(int column, int row) const;
  glm::dvec3 pointAt(double depth, glm::dvec2 slope) const;
  glm::ivec3 voxelAt(const ShownPoint& shown, const glm::dvec3& direction, const Probe& hit) const;

  ResolvedView view_;
  Camera camera_;
  WorldBox box_;
  glm::dvec2 depth_range_{0};  // of the volume's box, before the eye
  double anchor_depth_ = 0;
  glm::dmat4 index_from_world_;
  glm::ivec3 dims_;
  int finest_ = 0;       // level that is drawn
  ChannelInfo channel_;  // the first that is drawn
  int exponent_ = 0;     // of its densities on the device
};

}  // namespace blockwalk
