// SPDX-License-Identifier: Apache-2.0
// Values of flags: strict text forms in, UsageError naming the flag for anything else; and sizes as people read them.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <string_view>

#include "volume/voxel_box.h"

namespace blockwalk {

// "2GiB", "512MiB", "64KiB", "1000" (bytes)
std::uint64_t parseByteSize(std::string_view flag, std::string_view text);
// "512x512x300", each 1..kMaxDim
glm::ivec3 parseDims(std::string_view flag, std::string_view text);
// "0,0,10,512,512,20": two corners, each number 0..kMaxDim
VoxelBox parseBox(std::string_view flag, std::string_view text);
// "1,1,2.5", or one number for all three; each finite and above 0
glm::dvec3 parseSpacing(std::string_view flag, std::string_view text);

// "1.2 MiB"
std::string byteText(std::uint64_t bytes);

}  // namespace blockwalk
