// SPDX-License-Identifier: Apache-2.0
// What a ray gathers, mode by mode (docs/integration.md, "Modes").

const float kHugeDensity = 3.4028234e38;

struct Ink {
  vec3 color;  // premultiplied
  float transmittance;
  ivec3 voxel;  // first-hit, iso
  float t;
  bool done;
  float density;  // mip: the largest; mean: density x length
  float length_t;  // mean: of what was visible
};

bool isVisible(float density, Sample s) {
  if (kMode == kModeIso || kMode == kModeMip || kMode == kModeMean) return true;
  return kVoxelType == kVoxelRgba8 || s.extinction > 0.0;
}

// A visible piece of a ray of constant density. `color` is that of rgba8, `s` what shadeDensity() says.
void gather(float density, Sample s, float length_t, inout Ink ink) {
  if (kMode == kModeMip) {
    if (density > ink.density) {
      ink.density = density;
      ink.color = s.color;
      ink.transmittance = 0.0;
    }
  } else if (kMode == kModeMean) {
    ink.density += density * length_t;
    ink.length_t += length_t;
    if (kVoxelType == kVoxelRgba8) ink.color += s.color * (density * length_t);
  } else {
    float weight = ink.transmittance * opacityOfDepth(s.extinction * length_t);
    ink.color += weight * s.color;
    ink.transmittance -= weight;
    ink.done = ink.transmittance < kTransmittanceBound;
  }
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
