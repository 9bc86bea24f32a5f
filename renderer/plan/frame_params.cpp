// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/frame_params.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/plan/density_scale.h"

namespace blockwalk {
namespace {

constexpr double kFullLightShare = 500;  // docs/integration.md, "Light"
constexpr double kFarthestDensity = 1e38;

// World to the index space of a level, which is level 0's divided by 2^level.
glm::dmat4 levelFromWorld(const VolumeInfo& info, int level) {
  glm::dmat4 matrix = glm::inverse(info.world_from_index);
  const double scale = std::ldexp(1.0, -level);
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) matrix[column][row] *= scale;
  }
  return matrix;
}

void setRays(const Camera& camera, const VolumeInfo& info, const glm::dmat4& level_from_world,
             gpu::FrameParams& params) {
  const glm::dmat3 linear(level_from_world);
  const double depth = anchorDepth(camera, worldBox(info));
  const glm::dvec3 point = glm::dvec3(level_from_world * glm::dvec4(camera.eye + depth * camera.forward, 1));
  const glm::dvec3 dims = glm::ceil(glm::dvec3(params.box_max));
  const glm::dvec3 anchor = glm::clamp(glm::floor(point), glm::dvec3(0), dims);
  params.level.anchor = glm::ivec3(anchor);
  params.point_center = glm::vec3(point - anchor);
  const double spread = camera.orthographic ? 1 : depth;
  params.point_right = glm::vec3(linear * (spread * camera.half_width * camera.right));
  params.point_up = glm::vec3(linear * (spread * camera.half_height * camera.up));
  params.dir_center = glm::vec3(linear * camera.forward);
  if (!camera.orthographic) {
    params.dir_right = glm::vec3(linear * (camera.half_width * camera.right));
    params.dir_up = glm::vec3(linear * (camera.half_height * camera.up));
    params.half_width = static_cast<float>(camera.half_width);
    params.half_height = static_cast<float>(camera.half_height);
  }
  params.point_depth = static_cast<float>(depth);
  params.box_min -= glm::vec3(params.level.anchor);
  params.box_max -= glm::vec3(params.level.anchor);
}

// Plane n.p + w >= 0 in world becomes (n^T A) . q + n.(A anchor + b) + w >= 0 for p = A (q + anchor) + b.
// Scaled so that the left side is in voxels. A plane farther away than kFarPlane has all of the volume on one side, as
// one just there: its float stays finite.
void setClipPlanes(const std::vector<ClipPlane>& planes, const glm::dmat4& level_from_world, gpu::FrameParams& params) {
  constexpr double kFarPlane = 1e12;  // voxels; a volume's corners are nearer than 1e6 to the anchor
  const glm::dmat4 world_from_level = glm::inverse(level_from_world);
  const glm::dmat3 linear(world_from_level);
  const glm::dvec3 anchor_world = glm::dvec3(world_from_level * glm::dvec4(glm::dvec3(params.level.anchor), 1));
  for (const ClipPlane& plane : planes) {
    const glm::dvec3 normal = plane.normal * linear;
    const double scale = 1 / glm::length(normal);
    const double height = scale * (glm::dot(plane.normal, anchor_world) + plane.offset);
    params.clip_planes[params.clip_plane_count++] =
        glm::vec4(glm::vec3(scale * normal), static_cast<float>(std::clamp(height, -kFarPlane, kFarPlane)));
  }
}

float lightStrength(const VolumeInfo& info, std::size_t number) {
  const ChannelInfo& channel = info.channels[number];
  const double contrast = highDensity(info.type, channel) - static_cast<double>(emptyValue(info.type, channel));
  return static_cast<float>(kFullLightShare * unitDistance(info) / std::ldexp(contrast, densityExponent(info, number)));
}

// Attenuated-mip: the range of a view as it stands, on the device. Ends that are no floats lie where all data is one,
// and what is narrower than a float is nothing.
void setAttenuation(const ResolvedView& view, const VolumeInfo& info, const Plan& plan, gpu::FrameParams& params) {
  params.attenuation = static_cast<float>(std::min(view.attenuation / unitDistance(info), 1e35));
  for (std::size_t i = 0; i < plan.channels.size(); ++i) {
    const std::size_t number = plan.channels[i].channel;
    const DensityRange& range = view.channels[number].range;
    const auto stored = [&](double data) {
      return std::ldexp(info.channels[number].storedFromData(data), densityExponent(info, number));
    };
    const double lo = std::max(stored(range.lo), -kFarthestDensity);
    const double width = std::min(stored(range.hi), kFarthestDensity) - lo;
    params.level.channels[i].range_lo = static_cast<float>(lo);
    params.level.channels[i].range_width = width < std::numeric_limits<float>::min() ? 0 : static_cast<float>(width);
  }
}

void setChannels(const VolumeInfo& info, const Plan& plan, gpu::FrameParams& params) {
  static_assert(kMaxChannels == gpu::kMaxDrawnChannels);
  for (std::size_t i = 0; i < plan.channels.size(); ++i) {
    const ChannelPlan& drawn = plan.channels[i];
    const StoredRange range = onDevice(drawn.range, info, drawn.channel);
    params.level.channels[i].density_lo = range.lo;
    params.level.channels[i].density_hi = range.hi;
    params.level.channels[i].range_mask = drawn.range_mask;
    if (plan.key.lit != 0) params.level.channels[i].light_strength = lightStrength(info, drawn.channel);
  }
}

glm::ivec3 blockDims(const VolumeInfo& info, int level) {
  return latticeDims(info.levels[static_cast<std::size_t>(level)].dims, info.blockVoxels());
}

// Of coarser levels: what the parts that are bound do not say.
void setCoarse(const VolumeInfo& info, const Plan& plan, gpu::FrameData& data) {
  gpu::FrameParams& params = data.params;
  BLOCKWALK_CHECK(plan.farCount(), <=, std::size_t{gpu::kMaxFarLevels});
  params.far_count = static_cast<gpu::uint>(plan.farCount());
  params.stand_in = static_cast<gpu::uint>(plan.stand_in.value_or(0));
  // The kernel's depths begin at `point`.
  const auto depth = [&](std::size_t far) {
    return far < plan.farCount() ? static_cast<float>(plan.coarse[far].depth - static_cast<double>(params.point_depth))
                                 : std::numeric_limits<float>::infinity();
  };
  const auto transmittance = [&](std::size_t far) {
    return far < plan.farCount() ? static_cast<float>(plan.coarse[far].transmittance) : 0.0f;
  };
  params.level.depth_end = depth(0);
  params.level.transmittance_end = transmittance(0);
  for (std::size_t i = 0; i < plan.coarse.size(); ++i) {
    gpu::FrameLevel& coarse = data.coarse[i];
    const int shift = plan.coarse[i].level - plan.level;
    std::ranges::copy(params.level.channels, coarse.channels);
    coarse.shift = static_cast<gpu::uint>(shift);
    coarse.anchor = params.level.anchor >> shift;
    coarse.block_dims = blockDims(info, plan.coarse[i].level);
    coarse.depth_end = depth(i + 1);
    coarse.transmittance_end = transmittance(i + 1);
  }
}

// f(A w) has the gradient A^T grad f in world space.
void setLight(const ResolvedView& view, const VolumeInfo& info, const glm::dmat3& linear, gpu::FrameParams& params) {
  for (int row = 0; row < 3; ++row) params.gradient_rows[row] = glm::vec3(linear[row]);
  const Camera& camera = view.camera;
  const glm::dvec3 to = glm::normalize(view.key_light);
  params.light = glm::vec3(linear * (to.x * camera.right + to.y * camera.up - to.z * camera.forward));
  const Lights& lights = view.lights;
  params.lights = glm::vec4(lights.ambient, lights.head, lights.key, lights.highlight);
  params.shadow = view.shadow && lights.key > 0 ? 1 : 0;
  params.occlusion_reach = lights.ambient > 0 ? static_cast<float>(view.occlusion * unitDistance(info)) : 0.0f;
}

void setLens(const ResolvedView& view, gpu::FrameParams& params) {
  params.lens_radius = static_cast<float>(view.aperture);
  const double to_target = glm::dot(view.target - view.camera.eye, view.camera.forward);
  params.focus_depth = static_cast<float>(view.focus == kAtTarget ? to_target : view.focus);
}

}  // namespace

double anchorDepth(const Camera& camera, const WorldBox& box) {
  const glm::dvec3 center = 0.5 * (box.min + box.max);
  const double depth = glm::dot(center - camera.eye, camera.forward);
  if (camera.orthographic) return depth;
  const double radius = 0.5 * glm::length(box.max - box.min);
  return depth > radius ? depth : 0;
}

gpu::FrameData makeFrameData(const ResolvedView& view, const VolumeInfo& info, const Plan& plan) {
  gpu::FrameData data{};
  gpu::FrameParams& params = data.params;
  const glm::dmat4 level_from_world = levelFromWorld(info, plan.level);
  params.box_max = glm::vec3(glm::dvec3(info.dims) * std::ldexp(1.0, -plan.level));
  const Camera& camera = view.camera;
  setRays(camera, info, level_from_world, params);
  if (plan.key.lit != 0) setLight(view, info, glm::dmat3(level_from_world), params);
  if (plan.key.lens != 0) setLens(view, params);
  params.step_voxels = static_cast<float>(view.step);
  params.sample_bound = static_cast<gpu::uint>(std::ceil(std::sqrt(3.0) * info.subblock_side / view.step)) + 4;
  setClipPlanes(plan.planes, level_from_world, params);
  params.level.block_dims = blockDims(info, plan.level);
  params.size = {view.width, view.height};
  setChannels(info, plan, params);
  if (view.mode == Mode::attenuated_mip) setAttenuation(view, info, plan, params);
  setCoarse(info, plan, data);
  // Beyond the cap whatever has a length is opaque, and a product with a density of 255 stays finite.
  params.transmittance_bound = static_cast<float>(view.termination);
  params.extinction_scale = static_cast<float>(std::min(view.extinction / (255.0 * unitDistance(info)), 1e35));
  const float opacity = static_cast<float>(view.background[3]) / 255.0f;
  for (int i = 0; i < 3; ++i)
    params.background[i] = static_cast<float>(view.background[static_cast<std::size_t>(i)]) / 255.0f * opacity;
  params.background[3] = opacity;
  return data;
}

}  // namespace blockwalk
