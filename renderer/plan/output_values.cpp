// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/output_values.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "renderer/plan/density_scale.h"
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

// A pixel that nothing covers, as the kernel writes it.
std::uint32_t backgroundWord(const ResolvedView& view) {
  const auto& b = view.background;
  return b[3] == 0 ? 0 : b[0] | std::uint32_t{b[1]} << 8 | std::uint32_t{b[2]} << 16 | std::uint32_t{b[3]} << 24;
}

// Voxels: more than what rounding moves a point by that lies on a face.
constexpr double kIntoVoxel = 1e-3;

}  // namespace

OutputValues::OutputValues(const ResolvedView& view, const VolumeInfo& info, int finest)
    : view_(view),
      camera_(view.camera),
      box_(worldBox(info)),
      depth_range_(depthRange(camera_, info)),
      anchor_depth_(anchorDepth(camera_, box_)),
      index_from_world_(glm::inverse(info.world_from_index)),
      dims_(info.dims),
      finest_(finest),
      channel_(info.channels[static_cast<std::size_t>(view.drawn[0])]),
      exponent_(densityExponent(info, static_cast<std::size_t>(view.drawn[0]))) {}

void OutputValues::prepare(Frame& frame) const {
  const std::size_t pixels = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  frame.output = view_.output;
  switch (view_.output) {
    case Output::color:
    case Output::mesh:
      frame.pixels.assign(pixels, backgroundWord(view_));
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
    case Output::value: {
      const DensityRange& range = view_.channels[static_cast<std::size_t>(view_.drawn[0])].range;
      frame.values.assign(pixels, kNothing);
      frame.values_min.x = range.lo;
      frame.values_max.x = range.hi;
      return;
    }
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

void OutputValues::putWord(std::uint32_t word, const Aim& aim, Frame& frame) const {
  if (view_.output == Output::cost || view_.output == Output::queries) {
    frame.values[aim.at] = static_cast<float>(word);
    return;
  }
  if (view_.output == Output::value) {
    const auto density = static_cast<double>(std::bit_cast<float>(word));
    if (!std::isnan(density)) {
      frame.values[aim.at] = static_cast<float>(channel_.dataFromStored(std::ldexp(density, -exponent_)));
    }
    return;
  }
  const auto t = std::bit_cast<float>(word);
  if (t == gpu::kHugeT) return;
  const double depth = depthOf(t, aim.slope);
  if (view_.output == Output::depth) {
    frame.values[aim.at] = static_cast<float>(depth);
    return;
  }
  const glm::dvec3 point = pointAt(depth, aim.slope);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    frame.values[3 * aim.at + axis] = static_cast<float>(point[static_cast<int>(axis)]);
  }
}

void OutputValues::fromWords(std::span<const std::uint32_t> words, int row, Frame& frame) const {
  const auto width = static_cast<std::size_t>(view_.width);
  std::size_t at = static_cast<std::size_t>(row) * width;
  for (std::size_t i = 0; i < words.size(); ++i, ++at) {
    putWord(words[i], {.slope = slopeOf(static_cast<int>(at % width), static_cast<int>(at / width)), .at = at}, frame);
  }
}

void OutputValues::fromWord(std::uint32_t word, glm::ivec2 pixel, const std::function<int(double)>& level_at,
                            const Probe& hit, Frame& frame) const {
  if (isPicture(view_.output)) {
    frame.pixels[0] = word;
    return;
  }
  const Aim aim{.slope = slopeOf(pixel.x, pixel.y)};
  putWord(word, aim, frame);
  const auto t = std::bit_cast<float>(word);
  if (!showsPoint() || t == gpu::kHugeT) return;
  const double depth = depthOf(t, aim.slope);
  const glm::dvec3 from_eye = pointAt(depth, aim.slope) - pointAt(0, aim.slope);
  ShownPoint shown{.world = pointAt(depth, aim.slope), .t = glm::length(from_eye), .level = level_at(depth)};
  shown.voxel = voxelAt(shown, glm::normalize(pointAt(1, aim.slope) - pointAt(0, aim.slope)), hit);
  frame.shown = shown;
}

// Nearest: what begins at the point, on a face of its voxel, or lies inside it. What is known to be hit it lies in.
glm::ivec3 OutputValues::voxelAt(const ShownPoint& shown, const glm::dvec3& direction, const Probe& hit) const {
  glm::dvec3 index = glm::dvec3(index_from_world_ * glm::dvec4(shown.world, 1));
  const double side = std::ldexp(1.0, shown.level);
  if (view_.filter == Filter::nearest) {
    const glm::dvec3 along = glm::dmat3(index_from_world_) * direction;
    const double fastest = std::max({std::abs(along.x), std::abs(along.y), std::abs(along.z)});
    index += kIntoVoxel * side / fastest * along;
  }
  glm::ivec3 least(0);
  glm::ivec3 most = dims_ - 1;
  if (hit.x >= 0) {
    least = glm::ivec3(hit.x, hit.y, hit.z) * (1 << finest_);
    most = glm::min(most, least + static_cast<int>(side) - 1);
  }
  return glm::clamp(glm::ivec3(glm::floor(index)), least, most);
}

std::uint64_t OutputValues::countDrawn(const Frame& frame) const {
  const auto count = [](auto&& range, auto shows) {
    return static_cast<std::uint64_t>(std::ranges::count_if(range, shows));
  };
  switch (view_.output) {
    case Output::color:
    case Output::mesh:
      return count(frame.pixels, [background = backgroundWord(view_)](auto pixel) { return pixel != background; });
    case Output::depth:
      return count(frame.values, [](float depth) { return depth != kNoDepth; });
    case Output::value:
      return count(frame.values, [](float value) { return !std::isnan(value); });
    case Output::position:
      return count(frame.values, [](float part) { return !std::isnan(part); }) / 3;
    case Output::cost:
    case Output::queries:
      return count(frame.values, [](float number) { return number > 0; });
  }
  return 0;
}

}  // namespace blockwalk
