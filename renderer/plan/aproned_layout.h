// SPDX-License-Identifier: Apache-2.0
// How the kernel reads a subblock with its apron (shaders/voxels.glsl): rgba8 and f32 as volume/file/apron.h gives it,
// u8 and u16 in rows of words. A word holds four voxels, word j of a row those from 3 j on, so that its last is the
// next one's first and the two ends of every interpolation cell lie in one word. What lies behind a row's last voxel
// repeats it. That takes a fifth more memory (subblocks of 8 voxels a side) and half the loads.
#pragma once

#include <cstddef>
#include <span>

#include "volume/volume.h"

namespace blockwalk {

// Bytes of a subblock with its apron on the device.
std::uint64_t apronedSubblockBytes(const VolumeInfo& info);

// Of one with or without it.
inline std::uint64_t deviceSubblockBytes(const VolumeInfo& info, bool apron) {
  return apron ? apronedSubblockBytes(info) : info.subblockVoxels() * voxelBytes(info.type);
}

// Whole subblocks, one after the other, from the layout of volume/file/apron.h to the kernel's.
void layOutAproned(const VolumeInfo& info, std::span<const std::byte> subblocks, std::span<std::byte> out);

}  // namespace blockwalk
