#version 460
// SPDX-License-Identifier: Apache-2.0
// Cells beside active ones, by face, edge or corner. From any other a ray cannot be nearer to an active cell than a whole
// cell, so that what it meets next is the outside of the boundary (docs/finders.md).
#extension GL_GOOGLE_include_directive : require
#include "region.glsl"

layout(push_constant, scalar) uniform Push { SurroundPush push; };

void main() {
  ivec3 cell = ivec3(gl_GlobalInvocationID);
  if (!isInside(cell, push.cell_dims)) return;
  uint at = cellIndex(cell, push.cell_dims);
  uint state = uint(StateArray(push.states).at[at]);
  for (int i = 0; i < 27 && state == kCellCalm; ++i) {
    ivec3 beside = cell + ivec3(i % 3, i / 3 % 3, i / 9) - 1;
    bool touches = isInside(beside, push.cell_dims) &&
                   uint(StateArray(push.states).at[cellIndex(beside, push.cell_dims)]) == kCellActive;
    if (touches) state = kCellNear;
  }
  StateArray(push.surrounded).at[at] = uint8_t(state);
  if (state == kCellActive) atomicAdd(Counter(push.active_count).count, 1u);
}
