// SPDX-License-Identifier: Apache-2.0
// What must be resident for a plan whose kernel and levels stand.
#pragma once

#include "renderer/plan/plan.h"

namespace blockwalk {

inline bool isScalar(const VolumeInfo& info) { return info.type != VoxelType::rgba8; }

// In these modes a scalar's opacity says what is visible.
inline bool looksAtOpacity(const ResolvedView& view) {
  return view.mode == Mode::blend || view.mode == Mode::first_hit;
}

// Down to which stored value densities are looked up that no voxel need have: attenuated-mip goes down to the range's
// lower end, below the first point of a transfer function there is but one colour. Other modes: none.
double attenuatedReach(const ResolvedView& view, const VolumeInfo& info, const ChannelPlan& drawn);

void setNeeds(const ResolvedView& view, const VolumeInfo& info, Plan& plan);

}  // namespace blockwalk
