// SPDX-License-Identifier: Apache-2.0
#include "protocol/render_json.h"

#include <nlohmann/json.hpp>

#include "protocol/image_codec.h"
#include "protocol/reasons_json.h"

namespace blockwalk {

namespace {

nlohmann::json buildJson(const FinderBuild& build) {
  return {{"rebuilt", build.rebuilt},       {"macrocell", build.macrocell_voxels},
          {"macrocells", build.macrocells}, {"active_macrocells", build.active_macrocells},
          {"primitives", build.primitives}, {"bytes", build.bytes},
          {"tf_ms", build.tf_ms},           {"tris_ms", build.tris_ms},
          {"bvh_ms", build.bvh_ms},         {"total_ms", build.total_ms}};
}

}  // namespace

nlohmann::json statsJson(const RenderStats& stats) {
  nlohmann::json json = {{"gpu_ms", stats.gpu_ms},
                         {"total_ms", stats.total_ms},
                         {"rays", stats.rays},
                         {"queries", stats.queries},
                         {"block_visits", stats.block_visits},
                         {"subblock_visits", stats.subblock_visits},
                         {"voxel_steps", stats.voxel_steps},
                         {"finder", stats.finder},
                         {"walk", stats.walk},
                         {"cull", stats.cull},
                         {"level", stats.level},
                         {"kernel", stats.kernel},
                         {"loop_bound_hits", stats.loop_bound_hits},
                         {"non_finite", stats.non_finite},
                         {"drawn_pixels", stats.drawn_pixels}};
  if (stats.drawn_pixels == 0) json["reasons"] = reasonsJson(stats.reasons);
  if (stats.far_level != stats.level) json["far_level"] = stats.far_level;
  if (stats.paged || !stats.isComplete()) json["complete"] = stats.isComplete();
  if (stats.paged) {
    json["wanted_blocks"] = stats.wanted_blocks;
    json["absent_blocks"] = stats.absent_blocks;
    json["pages_read"] = stats.pages_read;
    if (!stats.page_failure.empty()) json["page_failure"] = stats.page_failure;
  }
  if (stats.finder_build.macrocells > 0) json["finder_build"] = buildJson(stats.finder_build);
  return json;
}

nlohmann::json rawJson(const ResolvedView& view) {
  const RawPixel pixel = rawPixel(view.output);
  return {{"width", view.width}, {"height", view.height}, {"channels", pixel.channels}, {"type", pixel.type}};
}

nlohmann::json deviceJson(const DeviceInfo& device) {
  return {{"name", device.name},
          {"driver", device.driver},
          {"driver_version", device.driver_version},
          {"api_version", device.api_version},
          {"kind", device.kind},
          {"ray_query", device.ray_query},
          {"subgroup_size", device.subgroup_size},
          {"memory_budget_bytes", device.memory_budget_bytes},
          {"memory_used_bytes", device.memory_used_bytes}};
}

}  // namespace blockwalk
