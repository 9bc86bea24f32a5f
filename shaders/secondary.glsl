// SPDX-License-Identifier: Apache-2.0
// Light that does not reach what is seen (docs/integration.md, "Shadow and ambient occlusion"): what a pixel shows is one
// point, where its opacity passes a half or what it hits; rays from there to the key light, and around, say which share of
// the light comes. They go the same way as all others, pass by pass, so that there is one place that integrates.

// Of one pixel, what its passes have found.
struct Passes {
  uint count;
  vec3 point;
  float weight;   // of what is found: less where the pixel is hardly opaque
  float ambient;  // summed over the directions
};

Passes firstPass() {
  uint around = frame.occlusion_reach > 0.0 ? kOcclusionRays : 0u;
  return Passes(kSecondary ? 2u + frame.shadow + around : 1u, vec3(0.0), 0.0, 0.0);
}

bool isLastPass(Passes passes, uint pass) { return pass + 1u >= passes.count; }

// First the point is looked for; the last one is the picture's own.
Ray rayOfPass(Passes passes, uint pass, Ray ray) {
  if (!kSecondary) return ray;
  scene.seeks_point = pass == 0u;
  scene.shades = isLastPass(passes, pass);
  if (pass == 0u || isLastPass(passes, pass)) return ray;
  bool is_shadow = frame.shadow != 0u && pass == 1u;
  uint around = push.sample_index * kOcclusionRays + pass - 1u - frame.shadow;
  vec3 direction = is_shadow ? frame.light : directionAround(around);
  return secondaryRay(passes.point, direction, is_shadow ? kHugeT : frame.occlusion_reach);
}

void notePass(uint pass, Ray ray, Ink ink, inout Passes passes) {
  if (!kSecondary || isLastPass(passes, pass)) return;
  if (pass == 0u) {
    passes.point = fma(ray.dir, vec3(ink.t), ray.start);
    passes.weight = kMode == kModeBlend ? clamp(2.0 - 4.0 * ink.transmittance, 0.0, 1.0) : 1.0;
    if (ink.t == kHugeT) passes.count = 2u;  // nothing to look from
  } else if (frame.shadow != 0u && pass == 1u) {
    scene.key_share = 1.0 - passes.weight * (1.0 - ink.transmittance);
  } else {
    // A plane hides half of all directions from what lies on it: that is not occluded.
    passes.ambient += ink.transmittance;
    float visible = min(2.0 * passes.ambient / float(kOcclusionRays), 1.0);
    scene.ambient_share = 1.0 - passes.weight * (1.0 - visible);
  }
}
