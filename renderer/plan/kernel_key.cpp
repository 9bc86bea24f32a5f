// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/kernel_key.h"

#include <fmt/format.h>

#include <cstddef>
#include <string_view>

#include "renderer/plan/plan.h"
#include "view/view.h"

namespace blockwalk {
namespace {

#define BLOCKWALK_CHECK_ID(id, type, member, constant, initial) \
  static_assert(offsetof(KernelKey, member) == (id) * sizeof(std::uint32_t));
BLOCKWALK_CHOICES(BLOCKWALK_CHECK_ID, BLOCKWALK_CHECK_ID)
#undef BLOCKWALK_CHECK_ID
static_assert(kKernelConstants == gpu::kChoiceCount);

// What views and files say is what the kernel compares with.
template <typename Enum>
constexpr bool is(Enum value, gpu::uint number) {
  return static_cast<gpu::uint>(value) == number;
}
static_assert(is(VoxelType::rgba8, gpu::kVoxelRgba8) && is(VoxelType::u8, gpu::kVoxelU8));
static_assert(is(VoxelType::u16, gpu::kVoxelU16) && is(VoxelType::f32, gpu::kVoxelF32));
static_assert(is(Mode::blend, gpu::kModeBlend) && is(Mode::first_hit, gpu::kModeFirstHit));
static_assert(is(Mode::blocks, gpu::kModeBlocks) && is(Mode::mip, gpu::kModeMip));
static_assert(is(Mode::mean, gpu::kModeMean) && is(Mode::iso, gpu::kModeIso));
static_assert(is(Mode::minip, gpu::kModeMinip) && is(Mode::attenuated_mip, gpu::kModeAttenuatedMip));
static_assert(is(Filter::nearest, gpu::kFilterNearest) && is(Filter::linear, gpu::kFilterLinear));
static_assert(is(Classification::post, gpu::kClassificationPost));
static_assert(is(Classification::pre_integrated, gpu::kClassificationPreIntegrated));
static_assert(is(Finder::query, gpu::kFinderQuery) && is(Finder::grid, gpu::kFinderGrid));
static_assert(is(Finder::clusters, gpu::kFinderClusters) && is(Finder::boundary, gpu::kFinderBoundary));
static_assert(is(Finder::octree, gpu::kFinderOctree) && is(Finder::none, gpu::kFinderNone));

}  // namespace

std::string describe(const KernelKey& key) {
  static constexpr std::string_view kModes[] = {"blend", "first-hit", "blocks", "mip",
                                                "mean",  "iso",       "minip",  "attenuated-mip"};
  std::string text = fmt::format("{} {} {}", voxelTypeName(static_cast<VoxelType>(key.voxel_type)), kModes[key.mode],
                                 finderName(static_cast<Finder>(key.finder)));
  const auto add = [&](std::uint32_t on, std::string_view word) {
    if (on != 0) text += fmt::format(" {}", word);
  };
  add(key.walk, "walk");
  add(key.cull, "cull");
  add(key.range_open, "range-open");
  add(key.test_voxel, "test-voxel");
  add(key.clip, "clip");
  add(key.filter, "linear");
  add(key.classification, "pre-integrated");
  add(key.lit, "lit");
  add(key.opaque_background == 0 ? 1 : 0, "transparent");
  static constexpr std::string_view kOutputs[] = {"", "point", "cost", "queries", "mesh", "value"};
  add(key.output, kOutputs[key.output]);
  add(key.antialias, "antialias");
  if (key.channels > 1) text += fmt::format(" {} channels", key.channels);
  add(key.count, "count");
  add(key.probe, "probe");
  add(key.fine_table, "fine-table");
  add(key.paged, "paged");
  add(key.mixed, "mixed");
  add(key.secondary, "secondary");
  add(key.lens, "lens");
  return text + fmt::format(" {}^3x{}^3", key.block_side, key.subblock_side);
}

}  // namespace blockwalk
