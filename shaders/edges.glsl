// SPDX-License-Identifier: Apache-2.0
// Output mesh: over the picture the edges of what the finder has found, where the ray first enters it: the faces of the
// boundary (Wald et al. 2021, 4.2), boxes of clusters, blocks, or an octree's leaves.

// The size of a pixel at t, in voxels.
float pixelSide(Ray ray, float t) {
  float height = 2.0 / float(frame.size.y);
  bool orthographic = frame.half_height == 0.0;
  return height * (orthographic ? length(frame.point_up) : (t - ray.t_eye) * frame.half_height * length(ray.dir));
}

// How much of its pixel the edges cover around the face through which the ray enters at t; 0 where it begins inside.
float edgeCover(Ray ray, float t) {
  vec3 place = ray.start + ray.dir * t;
  float side = kFinder == kFinderOctree ? float(kLeafVoxels) : float(kBlockVoxels);
  if (kFinder == kFinderBoundary || kFinder == kFinderClusters) side = scene.finder.macrocell_voxels;
  vec3 planes = (place + scene.anchor) / side;
  vec3 away = abs(planes - floor(planes + 0.5)) * side;
#ifdef BLOCKWALK_RAY_QUERY
  if (kFinder == kFinderClusters) {
    vec3 lo = BoxArray(scene.finder.boxes).at[2 * found_cluster] - scene.anchor;
    vec3 hi = BoxArray(scene.finder.boxes).at[2 * found_cluster + 1] - scene.anchor;
    away = min(abs(place - lo), abs(place - hi));
  }
#endif
  vec3 box_max = frame.box_max;
  if (kMixed) box_max = (box_max + vec3(frame.level.anchor)) / float(1u << scene.voxel_shift) - scene.anchor;
  away = min(away, abs(place - box_max));  // what reaches over the volume's end is cut there
  float nearest = min3(away);              // of the three planes that is the face's own
  if (nearest > 0.01 * side) return 0.0;
  float to_edge = away.x + away.y + away.z - nearest - max3(away);
  float pixel = pixelSide(ray, t);
  // Lines are a pixel and a half wide; where boxes are small they fade, so that they do not hide everything.
  return clamp(1.25 - to_edge / pixel, 0.0, 1.0) * clamp(0.125 * side / pixel, 0.0, 1.0);
}

void drawEdge(inout Ink ink) {
  float opacity = 0.85 * ink.edge;
  ink.color = mix(ink.color, vec3(1.0, 0.82, 0.25), opacity);
  ink.transmittance *= 1.0 - opacity;
}
