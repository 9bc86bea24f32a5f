// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/output_values.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "renderer/plan/frame_params.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

constexpr float kNoDepth = std::numeric_limits<float>::infinity();
constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

// The part of the corners' depths that lies before the eye.
glm::dvec2 depthRange(const Camera& camera, const VolumeInfo& info) {
  glm::dvec2 range(std::numeric_limits<double>::infinity(), 0);
  for (const glm::dvec3& corner : worldCorners(info)) {
    const double depth = glm::dot(corner - camera.eye, camera.forward);
    range = {std::min(range.x, depth), std::max(range.y, depth)};
  }
  return {std::max(range.x, 0.0), range.y};
}

}  // namespace

OutputValues::OutputValues(const ResolvedView& view, const VolumeInfo& info)
    : view_(view),
      camera_(view.camera),
      box_(worldBox(info)),
      depth_range_(depthRange(camera_, info)),
      anchor_depth_(anchorDepth(camera_, box_)) {}

void OutputValues::prepare(Frame& frame) const {
  const std::size_t pixels = static_cast<std::size_t>(view_.width) * static_cast<std::size_t>(view_.height);
  frame.output = view_.output;
  switch (view_.output) {
    case Output::color:
    case Output::mesh:
      frame.pixels.resize(pixels);
      return;
    case Output::depth:
      frame.values.assign(pixels, kNoDepth);
      frame.values_min.x = depth_range_.x;
      frame.values_max.x = depth_range_.y;
      return;
    case Output::position:
      frame.values.assign(3 * pixels, kNothing);
      frame.values_min = box_.min;
      frame.values_max = box_.max;
      return;
    case Output::cost:
    case Output::queries:
      frame.values.assign(pixels, 0);
      return;
  }
}

// How far a pixel's ray departs from the view direction, in half images: across and up.
glm::dvec2 OutputValues::slopeOf(int column, int row) const {
  return {(2.0 * column + 1) / view_.width - 1, 1 - (2.0 * row + 1) / view_.height};
}

double OutputValues::depthOf(float t, glm::dvec2 slope) const {
  if (camera_.orthographic) return anchor_depth_ + static_cast<double>(t);
  const glm::dvec2 offset = slope * glm::dvec2(camera_.half_width, camera_.half_height);
  return anchor_depth_ + static_cast<double>(t) / std::sqrt(1 + glm::dot(offset, offset));
}

glm::dvec3 OutputValues::pointAt(double depth, glm::dvec2 slope) const {
  const glm::dvec2 offset = slope * glm::dvec2(camera_.half_width, camera_.half_height);
  const glm::dvec3 across = offset.x * camera_.right + offset.y * camera_.up;
  return camera_.eye + depth * camera_.forward + (camera_.orthographic ? 1 : depth) * across;
}

void OutputValues::fromWords(std::span<const std::uint32_t> words, int row, Frame& frame) const {
  const auto width = static_cast<std::size_t>(view_.width);
  std::size_t at = static_cast<std::size_t>(row) * width;
  for (std::size_t i = 0; i < words.size(); ++i, ++at) {
    if (view_.output == Output::cost || view_.output == Output::queries) {
      frame.values[at] = static_cast<float>(words[i]);
      continue;
    }
    const auto t = std::bit_cast<float>(words[i]);
    if (t == gpu::kHugeT) continue;
    const glm::dvec2 slope = slopeOf(static_cast<int>(at % width), static_cast<int>(at / width));
    const double depth = depthOf(t, slope);
    if (view_.output == Output::depth) {
      frame.values[at] = static_cast<float>(depth);
      continue;
    }
    const glm::dvec3 point = pointAt(depth, slope);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      frame.values[3 * at + axis] = static_cast<float>(point[static_cast<int>(axis)]);
    }
  }
}

}  // namespace blockwalk
