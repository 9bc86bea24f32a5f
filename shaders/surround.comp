#version 460
// SPDX-License-Identifier: Apache-2.0
// Macrocells beside active ones, by face, edge or corner. From any other a ray cannot be nearer to an active
// macrocell than a whole macrocell, so that what it meets next is the outside of the boundary (docs/finders.md).
#extension GL_GOOGLE_include_directive : require
#include "region.glsl"

layout(push_constant, scalar) uniform Push { SurroundPush push; };

void main() {
  ivec3 macrocell = ivec3(gl_GlobalInvocationID);
  if (!isInside(macrocell, push.macrocell_dims)) return;
  uint at = latticeIndex(macrocell, push.macrocell_dims);
  uint state = uint(StateArray(push.states).at[at]);
  for (int i = 0; i < 27 && state == kMacrocellCalm; ++i) {
    ivec3 beside = macrocell + ivec3(i % 3, i / 3 % 3, i / 9) - 1;
    bool touches = isInside(beside, push.macrocell_dims) &&
                   uint(StateArray(push.states).at[latticeIndex(beside, push.macrocell_dims)]) == kMacrocellActive;
    if (touches) state = kMacrocellNear;
  }
  StateArray(push.surrounded).at[at] = uint8_t(state);
  if (state == kMacrocellActive) atomicAdd(Counter(push.active_count).count, 1u);
}
