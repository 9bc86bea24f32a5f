#version 460
// SPDX-License-Identifier: Apache-2.0
// Classification of macrocells (Wald et al. 2021, 4.2.1): active is where a channel's range holds a density that can be
// seen. Those densities are few intervals, so none of a transfer function's table is read.
#extension GL_GOOGLE_include_directive : require
#include "region.glsl"

layout(push_constant, scalar) uniform Push { ClassifyPush push; };

// Whether some interval meets [lo, hi]: the first that ends at or above lo begins at or below hi.
bool meets(ClassifiedChannel channel, float lo, float hi) {
  uint first = 0u;
  uint end = channel.interval_count;
  while (first < end) {
    uint middle = (first + end) / 2u;
    if (IntervalArray(channel.intervals).at[middle].y < lo) {
      first = middle + 1u;
    } else {
      end = middle;
    }
  }
  return first < channel.interval_count && IntervalArray(channel.intervals).at[first].x <= hi;
}

void main() {
  ivec3 place = ivec3(gl_GlobalInvocationID);
  if (!isInside(place, push.macrocell_dims)) return;
  uint macrocell = latticeIndex(place, push.macrocell_dims);
  bool is_active = false;
  for (uint c = 0u; c < push.channel_count; ++c) {
    GpuSubblock range = SubblockArray(push.channels[c].ranges).at[macrocell];
    bool seen = (range.range_mask & push.channels[c].range_mask) != 0u &&
                meets(push.channels[c], range.density_min, range.density_max);
    is_active = is_active || seen;
  }
  StateArray(push.states).at[macrocell] = uint8_t(is_active ? kMacrocellActive : kMacrocellCalm);
}
