// SPDX-License-Identifier: Apache-2.0
// From a density to colour and extinction, and light on a gradient (docs/integration.md).

struct Sample {
  vec3 color;
  float extinction;  // per world unit
};

// One load of 64 bits an entry (renderer/plan/transfer_table.h).
Sample entryAt(int c, uint index) {
  uvec2 entry = unpackUint2x32(U64Array(scene.channels[c].table).at[index]);
  return Sample(unpackColor(entry.y), uintBitsToFloat(entry.x));
}

// Between entries the table is linear.
Sample tableSample(int c, float stored) {
  float last = scene.channels[c].table_last;
  float index = clamp((stored - scene.channels[c].table_first) * scene.channels[c].table_scale, 0.0, last);
  if (kFineTable) return entryAt(c, wholeNumber(floor(index + 0.5)));
  float low = min(floor(index), last - 1.0);
  Sample a = entryAt(c, wholeNumber(low));
  Sample b = entryAt(c, wholeNumber(low) + 1u);
  float weight = index - low;
  return Sample(mix(a.color, b.color, weight), mix(a.extinction, b.extinction, weight));
}

// A point between voxels; `color` is that of rgba8.
Sample shadeDensity(int c, float density, vec3 color) {
  if (kVoxelType == kVoxelRgba8) return Sample(color, density * scene.extinction_scale);
  return tableSample(c, density);
}

// A voxel as it is stored: where the table has an entry for each stored value, 0 outside the range, that is its index
// (renderer/plan/transfer_table.h).
Sample shadeVoxel(int c, float density, uint bits) {
  if (kVoxelType == kVoxelRgba8) return Sample(colorOf(bits), density * scene.extinction_scale);
  bool exact = kVoxelType != kVoxelF32 && (kMode == kModeBlend || kMode == kModeFirstHit);
  return exact ? entryAt(c, bits) : tableSample(c, density);
}

// Adds a visible channel to the mixture at a point: extinctions are added, colours weighted by them (Max 1995).
void mixIn(Sample s, inout Sample mixture) {
  if (kChannels == 1) {
    mixture = s;
    return;
  }
  mixture.extinction += s.extinction;
  mixture.color += (s.color - mixture.color) * (s.extinction / mixture.extinction);
}

bool isShaded() { return kLit && (!kSecondary || scene.shades); }

// Blinn 1977, two-sided: a head light, whose half vector is the view vector, and one light beside it. `direction` is the
// ray's in index space per world unit, so that its product with the gradient is the slope along the unit view vector.
vec3 lightColor(int c, vec3 color, vec3 gradient, vec3 direction) {
  vec3 world = vec3(dot(scene.gradient_rows[0], gradient), dot(scene.gradient_rows[1], gradient),
                    dot(scene.gradient_rows[2], gradient));
  float largest = max(abs(world.x), max(abs(world.y), abs(world.z)));
  if (!(largest > 0.0)) return color;
  float steepness = largest * length(world / largest);  // neither overflows nor vanishes where the squares would
  float strength = min(steepness * scene.channels[c].light_strength, 1.0);  // little where the gradient has no direction to speak of
  float facing_eye = min(abs(dot(gradient, direction)) / steepness, 1.0);
  float facing_light = min(abs(dot(gradient, scene.light)) / steepness, 1.0);
  float ambient = kSecondary ? frame.lights.x * scene.ambient_share : frame.lights.x;
  float key = kSecondary ? frame.lights.z * scene.key_share : frame.lights.z;
  vec3 lit = color * (ambient + frame.lights.y * facing_eye + key * facing_light) + frame.lights.w * pow(facing_eye, 32.0);
  return color + strength * (lit - color);
}
