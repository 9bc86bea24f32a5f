// SPDX-License-Identifier: Apache-2.0
// KVX of Ken Silverman's Build engine and Slab6: columns of surface voxels with colours of a palette.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace blockwalk {

// The format has no word of its own: by what its first numbers must be.
bool startsLikeKvx(std::span<const std::byte> start, std::uint64_t file_bytes);

}  // namespace blockwalk
