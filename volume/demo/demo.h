// SPDX-License-Identifier: Apache-2.0
// Procedural volumes: deterministic, any size.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "volume/source.h"

namespace blockwalk {

// fossil, rock, chip (rgba8); vessels (u8); cells (u16); smoke (f32); tissue (u16, three channels); cosmos (u16 or
// f32), which says where it is blank
std::span<const std::string_view> demoNames();

// `size` is the longest axis in voxels, 1..kMaxDim. The same name, size and type give the same voxels on every machine.
// Without a type the demo's own, the first above. The source has random access. Throws DataError for an unknown name, a
// size out of bounds, and a type that the demo does not have.
std::unique_ptr<Source> openDemo(std::string_view name, int size, std::optional<VoxelType> type = std::nullopt);

}  // namespace blockwalk
