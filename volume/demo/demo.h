// SPDX-License-Identifier: Apache-2.0
// Procedural volumes: deterministic, any size.
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "volume/source.h"

namespace blockwalk {

// fossil, rock, chip (rgba8); vessels (u8); cells (u16); smoke (f32); tissue (u16, three channels)
std::span<const std::string_view> demoNames();

// `size` is the longest axis in voxels, 1..kMaxDim. The same name and size give the same voxels on every machine.
// The source has random access. Throws DataError for an unknown name or a size out of bounds.
std::unique_ptr<Source> openDemo(std::string_view name, int size);

}  // namespace blockwalk
