// SPDX-License-Identifier: Apache-2.0
// What a ray gathers, mode by mode (docs/integration.md, "Modes").

const float kHugeDensity = 3.4028234e38;

struct Ink {
  vec3 color;  // premultiplied
  float transmittance;
  ivec3 voxel;  // first-hit, iso
  float t;      // of the point shown, kHugeT where there is none
  bool done;
  float density;  // mip: the largest; mean: density x length
  float length_t;  // mean: of what was visible
  vec4 part;       // blend: colour and opacity of the subblock at hand by itself, not yet in the members above
  vec4 rest;       // blend: what colour and transmittance have gained in rounding
};

bool isVisible(float density, Sample s) {
  if (kMode == kModeIso || kMode == kModeMip || kMode == kModeMean) return true;
  return kVoxelType == kVoxelRgba8 || s.extinction > 0.0;
}

// A visible piece of a ray of constant density; `s` is what shadeDensity() says of it.
void gather(float density, Sample s, float t_begin, float length_t, inout Ink ink) {
  if (kMode == kModeMip) {
    if (density > ink.density) {
      ink.density = density;
      ink.color = s.color;
      ink.transmittance = 0.0;
      ink.t = kFilter == kFilterNearest ? t_begin : t_begin + 0.5 * length_t;
    }
  } else if (kMode == kModeMean) {
    ink.density += density * length_t;
    ink.length_t += length_t;
    if (kVoxelType == kVoxelRgba8) ink.color += s.color * (density * length_t);
  } else {
    float before = ink.transmittance * (1.0 - ink.part.a);
    ink.part += (1.0 - ink.part.a) * opacityOfDepth(s.extinction * length_t) * vec4(s.color, 1.0);
    float after = ink.transmittance * (1.0 - ink.part.a);
    ink.done = after < scene.transmittance_bound;
    if (kOutput == kOutputPoint && after <= 0.5) {
      ink.t = t_begin + min(log(2.0 * before) / s.extinction, length_t);  // before exp(-extinction s) = 1/2
      ink.done = true;
    }
  }
}

// Adds the subblock at hand to what lies before it. A transmittance near 1 cannot hold the small opacities of very many
// pieces one by one: they are summed from 0 inside a subblock, and the subblocks with compensation (Kahan 1965).
void settle(inout Ink ink) {
  if (kMode != kModeBlend) return;
  vec4 before = vec4(ink.color, ink.transmittance);
  precise vec4 change = ink.transmittance * vec4(ink.part.rgb, -ink.part.a) - ink.rest;
  precise vec4 after = before + change;
  precise vec4 rest = (after - before) - change;
  ink.color = after.rgb;
  ink.transmittance = after.a;
  ink.rest = rest;
  ink.part = vec4(0.0);
}

void hit(vec3 color, vec3 place, float t, inout Ink ink) {
  ink.color = color;
  ink.transmittance = 0.0;
  ink.voxel = ivec3(floor(place)) + ivec3(scene.anchor);
  ink.t = t;
  ink.done = true;
}

void finishMean(inout Ink ink) {
  if (!(ink.length_t > 0.0)) return;
  ink.transmittance = 0.0;
  if (kVoxelType == kVoxelRgba8) {
    ink.color = ink.density > 0.0 ? ink.color / ink.density : vec3(0.0);
  } else {
    ink.color = tableSample(ink.density / ink.length_t).color;
  }
}
