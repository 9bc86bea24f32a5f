// SPDX-License-Identifier: Apache-2.0
// What a renderer gives back: a picture or numbers a pixel, and what it cost. Plain data, no Vulkan.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "view/reasons.h"
#include "view/view.h"

namespace blockwalk {

// The active region that the finders clusters and boundary look for (docs/finders.md), as it was last built.
struct FinderBuild {
  bool rebuilt = false;          // by this frame; else what follows is of an earlier one
  int macrocell_voxels = 0;      // side of a macrocell; 0 where the finder has none
  std::uint64_t macrocells = 0;  // macrocells of the level's box
  std::uint64_t active_macrocells = 0;
  std::uint64_t primitives = 0;  // triangles, or boxes
  std::uint64_t bytes = 0;       // on the device, without the macrocells' ranges
  // Wall times. Wald et al. 2021, Table 1: T_tf, T_tris (clusters: merging), T_BVH, T_total.
  double tf_ms = 0;
  double tris_ms = 0;
  double bvh_ms = 0;
  double total_ms = 0;
};

// Times and counts are of all samples that the frame shows, those of a refinement's earlier steps too.
struct RenderStats {
  double gpu_ms = 0;          // sum over the bands, by timestamp queries
  double total_ms = 0;        // wall time of the calls
  std::uint64_t rays = 0;     // pixels times samples
  std::uint64_t queries = 0;  // times the finder was asked
  std::uint64_t block_visits = 0;
  std::uint64_t subblock_visits = 0;
  std::uint64_t voxel_steps = 0;
  std::string finder;
  bool walk = true;
  bool cull = true;
  int level = 0;       // the finest that was drawn
  int far_level = 0;   // the coarsest: of blocks far away
  std::string kernel;  // the kernel key, readable
  std::uint64_t loop_bound_hits = 0;
  std::uint64_t non_finite = 0;
  FinderBuild finder_build{};
  // Where voxels come and go (docs/large.md): times that rays came to blocks, and of these, to blocks whose voxels were
  // absent and that were shown coarser, band by band and channel by channel; of a frame that waited for nothing each
  // block once.
  bool paged = false;
  std::uint64_t wanted_blocks = 0;
  std::uint64_t absent_blocks = 0;
  std::uint64_t pages_read = 0;  // for this frame
  std::uint64_t foreseen_pages =
      0;                       // that it is the first to use of those that were brought in ahead (FrameOrder::ahead)
  std::string page_failure{};  // why some could not be read; empty: all could
  bool is_coarser = false;     // of a coarser level than the view wants, as a finer one has found no room
  bool as_it_is = false;       // it waited for nothing: what is absent may still come
  // Where it is not complete for want of room: what the level asked for needs, and what there is; 0 where unknown.
  std::uint64_t needed_bytes = 0;
  std::uint64_t room_bytes = 0;
  // That are not background alone; of numbers, that show something.
  std::uint64_t drawn_pixels = 0;
  std::vector<Reason> reasons{};  // why it is empty or coarser (view/reasons.h)
  bool isComplete() const { return absent_blocks == 0 && !is_coarser; }
};

// Per pixel, row 0 at the top. `probes` is filled only when asked for; of several samples it holds the last.
struct Probe {
  std::int32_t x = -1, y = -1, z = -1;  // first-hit: voxel of the level drawn; -1 when nothing is hit
  std::uint32_t blocks = 0;             // blocks: how many blocks of the range the ray crosses
  float t = 0;                          // first-hit: world distance from the eye (orthographic: from the eye's plane)
};

// The point that a pixel shows (docs/integration.md, Outputs).
struct ShownPoint {
  glm::dvec3 world{0};
  double t = 0;         // world distance from the eye along the ray, orthographic: from the eye's plane
  int level = 0;        // of the part of the picture that it lies in
  glm::ivec3 voxel{0};  // of level 0; nearest: what the ray enters at the point
};

struct Frame {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> pixels;  // straight rgba8, red in the lowest byte
  std::vector<Probe> probes;
  RenderStats stats;
  bool cancelled = false;  // then pixels and values are incomplete
  int samples_drawn = 0;   // a pixel, by this call: more than its step has where the sums had to be taken anew
  Output output = Output::color;
  // Instead of pixels, where output is not color, row by row: depth (1 a pixel, +infinity: nothing), position (3, NaN:
  // nothing), value (1, data units, NaN: nothing), cost and queries (1, whole numbers).
  std::vector<float> values{};
  std::optional<ShownPoint> shown{};  // of an order for one pixel, where its output is of a point
  // What a picture of the values runs over: x: the nearest and farthest depth of the volume's box that are before the
  // eye; the corners of its world box; the
  // ends of the channel's range; nothing for cost.
  glm::dvec3 values_min{0};
  glm::dvec3 values_max{0};
};

}  // namespace blockwalk
