// SPDX-License-Identifier: Apache-2.0
// A transfer function baked into the table that the kernel reads.
#pragma once

#include <vector>

#include "renderer/plan.h"

namespace blockwalk {

// Entries are (red, green, blue, extinction per world unit), all 0 outside the visible range.
// u8 and u16: one entry a stored value. f32: kFloatTableEntries over the visible part of the level's data, interpolated
// linearly. index = stored * scale + offset.
struct TransferTable {
  std::vector<glm::vec4> entries;
  float scale = 1;
  float offset = 0;
};

constexpr int kFloatTableEntries = 16384;
// Extinction a unit distance that stands for an opacity of 1: opaque after 2e-5 of it.
constexpr double kOpaqueExtinction = 1e6;

// `view` is resolved; `visible` comes from visibleRange().
TransferTable bakeTransfer(const View& view, const VolumeInfo& info, StoredRange visible, int level);

}  // namespace blockwalk
