// SPDX-License-Identifier: Apache-2.0
// finder octree (Lukic 2017): nodes of 8 bytes, the eight children of one in a run, walked with a stack. The next child is
// that behind the planes crossed, as Amanatides & Woo step through a lattice, so that a cube's exit is its neighbour's
// entry whatever their sizes. Leaves are subblocks, or blocks where blocks are counted.

BLOCKWALK_DERIVED int kLeafVoxels = kMode == kModeBlocks ? kBlockVoxels : kSubblockSide;

// The inner node at hand.
struct OctreePlace {
  int height;     // its side is 2^height leaves
  float side;     // voxels
  vec3 cell;      // its place, in nodes of its size
  uint children;  // where their run begins
};

vec3 octreeCorner(vec3 cell, float side) { return cell * side - scene.anchor; }

// Up from a node to the nearest around it, or itself, that the ray has not left at t.
void ascend(Ray ray, float t, uint path[kMaxOctreeDepth + 1], inout OctreePlace at) {
  for (int i = 0; i < scene.finder.octree_depth; ++i) {
    bool inside = min3(planeT(ray, octreeCorner(at.cell, at.side) + at.side * ray.forward)) > t;
    if (inside || at.height == scene.finder.octree_depth) return;
    at.height += 1;
    at.side *= 2.0;
    at.cell = floor(at.cell * 0.5);
    at.children = path[at.height];
  }
}

// The block of the first stored leaf at or after t, and the part of the ray that may show something there: the leaf's, or
// with walking all behind its entry, because a ray that walks asks again only across a gap.
uint findByOctree(Ray ray, float t, inout vec2 span, inout Work work) {
  uint wanted = kCull && kChannels == 1 ? scene.channels[0].range_mask : kOctreeStored;
  uint path[kMaxOctreeDepth + 1];
  OctreePlace at = OctreePlace(scene.finder.octree_depth, float(kLeafVoxels << scene.finder.octree_depth), vec3(0.0),
                               OctreeArray(scene.finder.octree).at[0].first);
  // A ray crosses fewer than 3 x 2^n cubes of 2^-n of the root's side; each is entered once and left once.
  int bound = 12 << scene.finder.octree_depth;
  for (int i = 0; i < bound; ++i) {
    float side = 0.5 * at.side;
    vec3 middle = octreeCorner(at.cell, at.side) + side;
    vec3 past = mix(vec3(0.0), vec3(1.0), lessThanEqual(planeT(ray, middle), vec3(t)));
    vec3 octant = mix(1.0 - past, past, ray.forward);
    vec3 cell = 2.0 * at.cell + octant;
    vec2 interval = cubeInterval(ray, octreeCorner(cell, side), side);
    OctreeNode node = OctreeArray(scene.finder.octree).at[at.children + uint(dot(octant, vec3(1.0, 2.0, 4.0)))];
    bool shows = (node.mask & wanted) != 0u && interval.y > t;
    if (shows && at.height == 1 && !isPassedOver(node.first)) {
      span = vec2(max(interval.x, t), kWalk ? ray.t_max : interval.y);
      return node.first;
    }
    if (shows && at.height > 1) {
      path[at.height] = at.children;
      at = OctreePlace(at.height - 1, side, cell, node.first);
    } else {
      t = max(t, interval.y);
      if (t >= ray.t_max) return kNone;
      ascend(ray, t, path, at);
    }
  }
  work.loop_bound_hits += 1u;
  return kNone;
}
