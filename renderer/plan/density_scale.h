// SPDX-License-Identifier: Apache-2.0
// f32 densities on the device are the stored ones times a power of two, 1 for nearly all volumes. Near the ends of what
// a float holds the kernel's arithmetic would fail: devices flush denormals to 0, and differences and sums of the
// largest values overflow. A power of two changes no digit.
#pragma once

#include <cstddef>
#include <span>

#include "renderer/plan/need.h"
#include "volume/volume.h"

namespace blockwalk {

// Density of a channel on the device = stored x 2^exponent. 0 for u8, u16 and rgba8, and where the largest density and
// the empty value are both within 2^-40..2^40 or 0; else so that the larger of them lies within 0.5..1.
int densityExponent(const VolumeInfo& info, std::size_t number);

float onDevice(float stored, int exponent);

// Every float of `voxels`, in place.
void toDevice(std::span<std::byte> voxels, int exponent);

// A range for comparisons on the device, also where denormals count as 0 there: what is above 0 in it stays so. A range
// that begins with the next float above the empty threshold does so on the device.
StoredRange onDevice(StoredRange range, const VolumeInfo& info, std::size_t number);

}  // namespace blockwalk
