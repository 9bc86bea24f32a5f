// SPDX-License-Identifier: Apache-2.0
// classification pre-integrated: intervals between two densities instead of samples (docs/integration.md,
// "Pre-integration").

// Integrals of extinction x colour and of extinction over stored value, from the table's start to `stored`; the second
// entry of each pair holds what the first lost in rounding.
void lookUpIntegrals(int c, float stored, out vec4 high, out vec4 low) {
  float index = clamp((stored - scene.channels[c].table_first) * scene.channels[c].table_scale, 0.0,
                      scene.channels[c].table_last);
  float whole = min(floor(index), scene.channels[c].table_last - 1.0);
  uint entry = wholeNumber(whole);
  float weight = index - whole;
  IntegralArray table = IntegralArray(scene.channels[c].integrals);
  // The step to the next entry is small, so adding it to the rest keeps the pair's precision.
  high = table.at[2u * entry];
  low = table.at[2u * entry + 1u] + weight * ((table.at[2u * entry + 2u] - high) + table.at[2u * entry + 3u] -
                                              table.at[2u * entry + 1u]);
}

// The mean colour (weighted by extinction) and mean extinction of a piece whose density goes linearly from front to back
// (Engel, Kraus, Ertl 2001, without attenuation inside the piece).
Sample sampleBetween(int c, float front, float back) {
  if (abs(back - front) * scene.channels[c].table_scale < 1.0) {
    float middle = 0.5 * (front + back);
    if (!isInRange(c, middle)) return Sample(vec3(0.0), 0.0);
    return tableSample(c, middle);
  }
  vec4 high_front, low_front, high_back, low_back;
  lookUpIntegrals(c, front, high_front, low_front);
  lookUpIntegrals(c, back, high_back, low_back);
  vec4 integral = ((high_back - high_front) + (low_back - low_front)) / (back - front);
  if (!(integral.a > 0.0)) return Sample(vec3(0.0), 0.0);
  return Sample(integral.rgb / integral.a, integral.a);
}

// What channel c shows of the piece from t to `next`: gathered, a single channel's at once, or added to the mixture. The
// density at the piece's beginning is `front`, which becomes that at its end.
void addPiece(int c, Ray ray, uint64_t voxels, vec3 corner, float t, float next, inout float front,
              inout Sample mixture, inout Ink ink) {
  float back = densityAt(voxels, placeAt(ray, next) - corner);
  Sample s = sampleBetween(c, front, back);
  float middle = 0.5 * (front + back);
  front = back;
  if (!(s.extinction > 0.0)) return;
  noteDensity(middle, ink);
  s.color = litColor(c, s.color, voxels, placeAt(ray, 0.5 * (t + next)) - corner, ray);
  if (kChannels == 1) {
    gather(s, t, next - t, ink);
  } else {
    mixIn(s, mixture);
  }
}

// The lattice's intervals, cut where the ray enters and leaves the subblock too.
void integratePreIntegrated(Ray ray, SubblockVoxels voxels, vec3 corner, float t_begin, float t_end, inout Ink ink,
                            inout Work work) {
  float k = floor(t_begin / ray.dt);
  float t = t_begin;
  float front[kMaxDrawnChannels];
  forEachChannel(c) {
    if (mayShow(voxels, c)) front[c] = densityAt(voxels.at[c], placeAt(ray, t) - corner);
  }
  for (uint i = 0u; i < scene.sample_bound; ++i) {
    float next = min((k + 1.0) * ray.dt, t_end);
    if (next > t) {
      if (kTally) work.voxel_steps += 1u;
      Sample mixture = Sample(vec3(0.0), 0.0);
      forEachChannel(c) {
        if (mayShow(voxels, c)) addPiece(c, ray, voxels.at[c], corner, t, next, front[c], mixture, ink);
      }
      if (kChannels > 1 && mixture.extinction > 0.0) gather(mixture, t, next - t, ink);
      if (ink.done) return;
      t = next;
    }
    if (next >= t_end) return;
    k += 1.0;
  }
  work.loop_bound_hits += 1u;
}
