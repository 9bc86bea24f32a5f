#version 460
// SPDX-License-Identifier: Apache-2.0
// The boundary of the active region (Wald et al. 2021, 4.2.2, Listing 1), one kernel a direction: an invocation is a
// face of the macrocell grid across kAxis. Where just one of its two macrocells is active it writes two triangles,
// wound so that cross(b - a, c - a) points to the inactive side, which is their front. Outside the grid nothing is
// active.  Each face is moved outwards by `slack` and stretched by twice that: together they bound the active
// macrocells enlarged by it, and overlap where they meet, so that the driver's rounding cannot carry a ray past them
// or between them that the exact planes take through an active macrocell.
#extension GL_GOOGLE_include_directive : require
#include "region.glsl"

layout(push_constant, scalar) uniform Push { BoundaryPush push; };
layout(constant_id = 0) const int kAxis = 0;

const float kOverlap = 1.0625;

bool isActive(ivec3 macrocell) {
  return isInside(macrocell, push.macrocell_dims) &&
         uint(StateArray(push.states).at[latticeIndex(macrocell, push.macrocell_dims)]) == kMacrocellActive;
}

void writeVertex(uint face, uint number, vec3 place) {
  for (int axis = 0; axis < 3; ++axis) {
    FloatArray(push.vertices).at[face * kFaceFloats + 3u * number + uint(axis)] = place[axis];
  }
}

void main() {
  ivec3 current = ivec3(gl_GlobalInvocationID);
  ivec3 along = ivec3(kAxis == 0, kAxis == 1, kAxis == 2);
  if (!isInside(current, push.macrocell_dims + along)) return;
  bool behind = isActive(current - along);
  if (behind == isActive(current)) return;
  uint face = atomicAdd(Counter(push.face_count).count, 1u);
  if (face >= push.capacity) return;

  ivec3 u_axis = ivec3(kAxis == 2, kAxis == 0, kAxis == 1);
  vec3 u = (push.macrocell_voxels + 4.0 * push.slack) * vec3(u_axis);
  ivec3 v_axis = ivec3(1) - along - u_axis;
  vec3 v = (push.macrocell_voxels + 4.0 * push.slack) * vec3(v_axis);
  vec3 corner = push.macrocell_voxels * vec3(current) - 2.0 * push.slack * vec3(u_axis + v_axis) +
                (behind ? push.slack : -push.slack) * vec3(along);
  // (u, v, along) is right-handed. Each triangle is a little more than half of the face: they overlap along its diagonal.
  vec3 opposite = corner + u + v;
  vec3 first = kOverlap * (behind ? u : v);
  vec3 second = kOverlap * (behind ? v : u);
  writeVertex(face, 0u, corner);
  writeVertex(face, 1u, corner + first);
  writeVertex(face, 2u, corner + second);
  writeVertex(face, 3u, opposite);
  writeVertex(face, 4u, opposite - first);
  writeVertex(face, 5u, opposite - second);
}
