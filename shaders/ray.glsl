// SPDX-License-Identifier: Apache-2.0
// Rays and the one DDA. Every t of the traversal is planeT() of a whole-number plane, so the exit of a cell and the entry
// of its neighbour are the same float, and monotone in the plane: the cells of any level partition [t_min, t_max] exactly.

struct Ray {
  vec3 origin;   // relative index space; where the direction is 0 the centre of the voxel column
  vec3 dir;      // relative index units per world unit
  vec3 inverse;  // 1 / dir, finite and huge where dir is 0
  vec3 forward;  // 1 where the ray goes up an axis, else 0
  float t_min;
  float t_max;
  float t_eye;
  vec3 start;     // as origin, but exactly where the ray is: what filter linear samples from
  float dt;       // filter linear: distance of samples, world units
  float length_per_depth;  // of the way along it, by that along the view's direction
};

vec3 planeT(Ray ray, vec3 plane) { return (plane - ray.origin) * ray.inverse; }

// A whole number of 0..2^23 - 1 as an integer: the last 23 bits of a float of 2^23 and more are its units. A conversion
// would have to mind NaN and what is too large, for which lavapipe goes from lane to lane.
uint wholeNumber(float number) { return floatBitsToUint(number + 8388608.0) & 0x7fffffu; }

// Not min() and max(), which must choose between a number and NaN: planes are numbers.
float lesser(float a, float b) { return a < b ? a : b; }
float greater(float a, float b) { return a > b ? a : b; }
float min3(vec3 v) { return lesser(v.x, lesser(v.y, v.z)); }
float max3(vec3 v) { return greater(v.x, greater(v.y, v.z)); }

// Entry and exit of the cube of `side` voxels whose lowest corner is `corner`.
vec2 cubeInterval(Ray ray, vec3 corner, float side) {
  vec3 near = planeT(ray, corner + side * (1.0 - ray.forward));
  vec3 far = planeT(ray, corner + side * ray.forward);
  return vec2(max3(near), min3(far));
}

// Of a ray that has origin, direction and t_eye the rest, cut to what is drawn of the volume.
void completeRay(inout Ray ray) {
  // A component this small moves the ray by less than 1e-7 of a voxel over 65536 voxels: it is 0.
  bvec3 still = lessThanEqual(abs(ray.dir), vec3(1e-12 * max3(abs(ray.dir))));
  ray.dir = mix(ray.dir, vec3(0.0), still);
  ray.inverse = mix(1.0 / ray.dir, vec3(kHugeT), still);
  ray.forward = mix(vec3(0.0), vec3(1.0), greaterThanEqual(ray.dir, vec3(0.0)));

  vec3 near_plane = mix(frame.box_max, frame.box_min, ray.forward);
  vec3 far_plane = mix(frame.box_min, frame.box_max, ray.forward);
  vec3 near_still = mix(vec3(-kHugeT), vec3(kHugeT), greaterThan(near_plane, ray.origin));
  vec3 far_still = mix(vec3(-kHugeT), vec3(kHugeT), greaterThan(far_plane, ray.origin));
  vec3 near = mix(planeT(ray, near_plane), near_still, still);
  vec3 far = mix(planeT(ray, far_plane), far_still, still);
  ray.t_min = max(max3(near), ray.t_eye);
  ray.t_max = min3(far);
  if (kClip) {
    for (uint i = 0; i < frame.clip_plane_count; ++i) {
      vec4 plane = Frame(push.frame).data.params.clip_planes[i];  // by its address: the index is no constant
      float height = dot(plane.xyz, ray.origin) + plane.w;
      float slope_t = dot(plane.xyz, ray.dir);
      if (slope_t > 0.0) {
        ray.t_min = max(ray.t_min, -height / slope_t);
      } else if (slope_t < 0.0) {
        ray.t_max = min(ray.t_max, -height / slope_t);
      } else if (height < 0.0) {
        ray.t_max = ray.t_min;
      }
    }
  }
  ray.start = ray.origin;
  float largest = max3(abs(ray.dir));  // its square need be no float
  ray.dt = frame.step_voxels / (largest * length(ray.dir / largest));
  // Inside the box only the voxel column counts; its centre keeps every plane away from the ray.
  ray.origin = mix(ray.origin, floor(ray.origin) + 0.5, still);
}

// The ray through a place of a pixel, [0, 1) to the right and downwards, from a place on the lens, a disc of radius 1. All
// that go through one point at the depth of the focus come from there.
Ray makeRay(ivec2 pixel, vec2 place, vec2 lens) {
  vec2 position = (vec2(2 * pixel - frame.size) + 2.0 * place) / vec2(frame.size);
  position.y = -position.y;
  Ray ray;
  ray.origin = frame.point_center + position.x * frame.point_right + position.y * frame.point_up;
  if (kLens) {
    vec2 shift = frame.lens_radius * lens / vec2(frame.half_width, frame.half_height);
    position -= shift / frame.focus_depth;
    shift *= 1.0 - frame.point_depth / frame.focus_depth;
    ray.origin += shift.x * frame.dir_right + shift.y * frame.dir_up;
  }
  vec2 slope = position * vec2(frame.half_width, frame.half_height);
  float world_length = sqrt(1.0 + dot(slope, slope));
  ray.dir = (frame.dir_center + position.x * frame.dir_right + position.y * frame.dir_up) / world_length;
  ray.t_eye = -frame.point_depth * world_length;
  ray.length_per_depth = world_length;
  completeRay(ray);
  return ray;
}

// From a point that a ray has come to; `dir` per world unit. It begins a voxel and a half away along its main axis, off what it
// starts on, and ends at `reach`.
Ray secondaryRay(vec3 from, vec3 dir, float reach) {
  Ray ray;
  ray.origin = from;
  ray.dir = dir;
  ray.t_eye = 1.5 / max3(abs(dir));
  ray.length_per_depth = 1.0;
  completeRay(ray);
  ray.t_max = min(ray.t_max, reach);
  return ray;
}

// Area for area.
vec2 onDisc(vec2 units) {
  float turn = 6.2831853 * units.y;
  return sqrt(units.x) * vec2(cos(turn), sin(turn));
}

// World directions around a point, a unit vector each, in index space. The sequence's own first one lies along an axis, in
// which rays stay in one plane of faces all the way.
vec3 directionAround(uint index) {
  vec2 units = directionUnits(index + 1u);
  float axis = 1.0 - 2.0 * units.x;
  float turn = 6.2831853 * units.y;
  vec2 across = sqrt(1.0 - axis * axis) * vec2(cos(turn), sin(turn));
  return across.x * frame.gradient_rows[0] + across.y * frame.gradient_rows[1] + axis * frame.gradient_rows[2];
}

// Amanatides & Woo's walk through a lattice of count^3 cubes of `side` voxels, on planes instead of sums.
struct Dda {
  vec3 far;     // the planes at which the current cell ends
  vec3 t_far;   // planeT(far)
  float index;  // of the current cell: its coordinates times the strides; a whole number below 2^24
  float t;      // where the current cell begins
  float t_exit;
};

// Index steps of a lattice of `count` cells.
vec3 latticeStrides(vec3 count) { return vec3(1.0, count.x, count.x * count.y); }

// `t` lies inside the lattice: the cell along each axis is the one with planeT(near) <= t < planeT(far).
Dda enterDda(Ray ray, vec3 corner, float side, vec3 count, vec3 strides, float t) {
  vec3 direction = 2.0 * ray.forward - 1.0;
  vec3 guess = clamp(floor((ray.origin + ray.dir * t - corner) * (1.0 / side)), vec3(0.0), count - 1.0);
  vec3 far = corner + side * (guess + ray.forward);
  // The guess may be off by rounding, or by clamping at the lattice's end: one cell at most.
  vec3 behind = mix(vec3(0.0), vec3(1.0), greaterThan(planeT(ray, far - side * direction), vec3(t)));
  vec3 ahead = mix(vec3(0.0), vec3(1.0), lessThanEqual(planeT(ray, far), vec3(t)));
  vec3 cell = clamp(guess + (ahead - behind) * direction, vec3(0.0), count - 1.0);
  Dda dda;
  dda.far = corner + side * (cell + ray.forward);
  dda.t_far = planeT(ray, dda.far);
  dda.index = dot(cell, strides);
  dda.t = t;
  dda.t_exit = min3(dda.t_far);
  return dda;
}

// To the next cell through the planes crossed at t_exit; several at once on an edge or corner. The caller stops where
// t_exit reaches the end of the lattice, whose far planes are planes of the last cells: the index never leaves it.
void stepDda(Ray ray, float side, vec3 strides, inout Dda dda) {
  vec3 shift = mix(vec3(0.0), 2.0 * ray.forward - 1.0, lessThanEqual(dda.t_far, vec3(dda.t_exit)));
  dda.index += dot(shift, strides);
  dda.far += side * shift;
  dda.t_far = planeT(ray, dda.far);
  dda.t = dda.t_exit;
  dda.t_exit = min3(dda.t_far);
}
