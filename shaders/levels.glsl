// SPDX-License-Identifier: Apache-2.0
// Levels of one frame (docs/integration.md, "Level of detail"): the nearest part of a ray is drawn of the finest, farther
// parts of coarser ones, each with finders and voxels of its own.

#define coarseAt(level) Frame(push.frame).data.coarse[(level) - 1u]

// What is in index space of the level at hand, from that of the finest.
void setScale(uint shift) {
  float scale = 1.0 / float(1u << shift);
  for (int row = 0; row < 3; ++row) scene.gradient_rows[row] = frame.gradient_rows[row] * scale;
  scene.light = frame.light * scale;
  scene.voxel_shift = shift;
}

// Level 0 is the finest of the frame.
void loadLevel(uint level) {
  scene.sample_bound = frame.sample_bound;
  scene.level = level;
  scene.transmittance_end = level == 0u ? frame.level.transmittance_end : coarseAt(level).transmittance_end;
  if (!kDrawsLevels || level == 0u) {
    forEachChannel(c) scene.channels[c] = frame.level.channels[c];
    scene.anchor = vec3(frame.level.anchor);
    scene.pages = frame.level.pages;
    setScale(0u);
    return;
  }
  forEachChannel(c) scene.channels[c] = coarseAt(level).channels[c];
  scene.finder = coarseAt(level).finder;
  scene.ancestors = coarseAt(level).ancestors;
  scene.anchor = vec3(coarseAt(level).anchor);
  scene.block_dims = coarseAt(level).block_dims;
  scene.pages = coarseAt(level).pages;
  setScale(coarseAt(level).shift);
}

// From the index space of a level, relative to its anchor, to that of one `shift` coarser.
Ray coarserRay(Ray ray, vec3 from, ivec3 anchor, uint shift) {
  float scale = 1.0 / float(1u << shift);  // a power of two: exact
  vec3 offset = from - vec3(anchor << shift);  // whole voxels
  ray.origin = (ray.origin + offset) * scale;
  ray.start = (ray.start + offset) * scale;
  ray.dir *= scale;
  ray.inverse /= scale;
  return ray;
}

// The part of a ray of the finest level that is drawn of the level, from where the part before it ended: still in the finest
// level's index space. Its steps are as many of the level's own voxels, on a lattice of their own.
Ray partOfLevel(Ray ray, uint level, float t_begin) {
  float depth_end = level == 0u ? frame.level.depth_end : coarseAt(level).depth_end;
  ray.t_min = max(ray.t_min, t_begin);
  ray.t_max = max(min(ray.t_max, depth_end * ray.length_per_depth), ray.t_min);
  if (level > 0u) ray.dt *= float(1u << coarseAt(level).shift);
  return ray;
}

// The scene and a ray of the finest level become the level's.
void enterLevel(uint level, inout Ray ray) {
  if (level == 0u) return;
  ray = coarserRay(ray, vec3(frame.level.anchor), coarseAt(level).anchor, coarseAt(level).shift);
  loadLevel(level);
}
