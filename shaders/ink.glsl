// SPDX-License-Identifier: Apache-2.0
// What a ray gathers, mode by mode (docs/integration.md, "Modes").

const float kHugeDensity = 3.4028234e38;

struct Ink {
  vec3 color;  // premultiplied
  float transmittance;
  ivec3 voxel;  // first-hit, iso
  float t;      // of the point shown, kHugeT where there is none
  bool done;
  float edge;  // output mesh: of the pixel, what edges cover; below 0 before anything is found
  // mip: the largest; minip: the least, negated; attenuated-mip: the largest attenuated share of the range; mean:
  // density x length; else of output value: of the piece at hand.
  float density[kMaxDrawnChannels];
  float length_t[kMaxDrawnChannels];  // mean: of what was visible; attenuated-mip: optical depth of it
  vec4 part;  // blend: colour and opacity of the subblock at hand by itself, not yet in the members above
  vec4 rest;  // blend: what colour and transmittance have gained in rounding
};

Ink freshInk() {
  Ink ink;
  ink.color = vec3(0.0);
  ink.transmittance = 1.0;
  ink.voxel = ivec3(-1);
  ink.t = kHugeT;
  ink.done = false;
  ink.edge = -1.0;
  forEachChannel(c) {
    ink.density[c] = kMode == kModeMean ? 0.0 : -kHugeDensity;
    ink.length_t[c] = 0.0;
  }
  ink.part = vec4(0.0);
  ink.rest = vec4(0.0);
  return ink;
}

// Where most of a span is visible, what is not is gathered too, with an opacity of 0, and a ray that is done goes on to the
// span's end: a branch in so short a loop costs more than it saves, and what follows need not wait for the last sample's
// transmittance.
BLOCKWALK_DERIVED bool kShowsMost = kCull || kRangeOpen;
BLOCKWALK_DERIVED bool kFindsPoint = kOutput == kOutputPoint || kOutput == kOutputValue;
BLOCKWALK_DERIVED bool kStraight = kShowsMost && kMode == kModeBlend && kChannels == 1 && !kLit && !kFindsPoint;

// Whether one density of a ray is shown.
BLOCKWALK_DERIVED bool kShowsExtreme = kMode == kModeMip || kMode == kModeMinip || kMode == kModeAttenuatedMip;
// Whether each channel's densities are gathered by themselves, and mixed in the end alone.
BLOCKWALK_DERIVED bool kGathersDensities = kShowsExtreme || kMode == kModeMean;

bool isVisible(float density, Sample s) {
  if (kMode == kModeIso || kGathersDensities) return true;
  return kVoxelType == kVoxelRgba8 || s.extinction > 0.0;
}

// Output value: the density of a visible piece, which is the point's when that lies in it.
void noteDensity(float density, inout Ink ink) {
  if (kOutput == kOutputValue && !kGathersDensities) ink.density[0] = density;
}

// attenuated-mip: where in the range a density lies, attenuated by what was passed before it: a voxel is met where the ray
// enters it, a sample in its middle.
float attenuatedShare(int c, float density, float length_t, inout Ink ink) {
  float width = scene.channels[c].range_width;
  float share = width > 0.0 ? clamp((density - scene.channels[c].range_lo) / width, 0.0, 1.0) : 1.0;
  float depth = share * frame.attenuation * length_t;
  float before = ink.length_t[c] + (kFilter == kFilterNearest ? 0.0 : 0.5 * depth);
  ink.length_t[c] += depth;
  return share * exp2(-1.44269504 * before);
}

// Modes that gather densities: a visible piece of a ray of constant density in a channel. `color` is that of rgba8.
void gatherDensity(int c, float density, vec3 color, float t_begin, float length_t, inout Ink ink) {
  if (kShowsExtreme) {
    float rank = kMode == kModeMinip ? -density : density;
    if (kMode == kModeAttenuatedMip) rank = attenuatedShare(c, density, length_t, ink);
    if (rank > ink.density[c]) {
      ink.density[c] = rank;
      if (kVoxelType == kVoxelRgba8) ink.color = color;
      ink.transmittance = 0.0;
      ink.t = kFilter == kFilterNearest ? t_begin : t_begin + 0.5 * length_t;
    }
    // What is still to come is attenuated below what is there.
    if (kMode == kModeAttenuatedMip && kChannels == 1) ink.done = exp2(-1.44269504 * ink.length_t[c]) <= ink.density[c];
  } else {
    ink.density[c] += density * length_t;
    ink.length_t[c] += length_t;
    if (kVoxelType == kVoxelRgba8) ink.color += color * (density * length_t);
  }
}

// blend: a visible piece of a ray of constant colour and extinction.
void gather(Sample s, float t_begin, float length_t, inout Ink ink) {
  float before = ink.transmittance * (1.0 - ink.part.a);
  ink.part += (1.0 - ink.part.a) * opacityOfDepth(s.extinction * length_t) * vec4(s.color, 1.0);
  float after = ink.transmittance * (1.0 - ink.part.a);
  ink.done = after < scene.transmittance_bound;
  bool seeks = kFindsPoint || (kSecondary && scene.seeks_point && ink.t == kHugeT);
  if (seeks && after <= 0.5) {
    ink.t = t_begin + min(log(2.0 * before) / s.extinction, length_t);  // before exp(-extinction s) = 1/2
    ink.done = ink.done || kFindsPoint;
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
  ink.voxel = (ivec3(floor(place)) + ivec3(scene.anchor)) << scene.voxel_shift;
  ink.t = t;
  ink.done = true;
}

// Whether anything visible of a channel was gathered, and the density that is shown of it.
bool hasGathered(Ink ink, int c) { return kMode == kModeMean ? ink.length_t[c] > 0.0 : ink.density[c] > -kHugeDensity; }

float shownDensity(Ink ink, int c) {
  if (kMode == kModeMean) return ink.density[c] / ink.length_t[c];
  if (kMode == kModeMinip) return -ink.density[c];
  if (kMode == kModeAttenuatedMip) return scene.channels[c].range_lo + scene.channels[c].range_width * ink.density[c];
  return ink.density[c];
}

// Modes that gather densities: the channels' own colours, added.
void mixDensities(inout Ink ink) {
  if (kMode == kModeMean && kVoxelType == kVoxelRgba8) {
    ink.color = ink.density[0] > 0.0 ? ink.color / ink.density[0] : vec3(0.0);
  }
  forEachChannel(c) {
    if (hasGathered(ink, c)) {
      ink.transmittance = 0.0;
      if (kVoxelType != kVoxelRgba8) ink.color += tableSample(c, shownDensity(ink, c)).color;
    }
  }
}
