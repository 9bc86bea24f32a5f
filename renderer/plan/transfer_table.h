// SPDX-License-Identifier: Apache-2.0
// A transfer function baked into the tables that the kernel reads.
#pragma once

#include <cstdint>
#include <vector>

#include "renderer/plan/need.h"
#include "volume/volume.h"

namespace blockwalk {

// An entry is the extinction per world unit as a float's bits in the lower word, and the packed colour in the upper
// (unpackColor() in shaders/kernel_interface.h): what a sample needs of it is one load.
// Exact (filter nearest, u8 and u16, blend and first-hit): one entry a stored value, all 0 outside the visible range.
// Otherwise kTableEntries over the visible part of the level's data, interpolated linearly; what is outside the visible
// range must not be looked up. index = (density - first) * scale, with the density as it is on the device
// (renderer/plan/density_scale.h).
struct TransferTable {
  std::vector<std::uint64_t> entries;
  // Two a table entry: integrals over stored value from the first entry of (extinction x colour, extinction), and what
  // they lost in rounding to float. Only for pre-integration.
  std::vector<glm::vec4> integrals;
  float scale = 1;
  float first = 0;
};

constexpr int kTableEntries = 16384;
// Extinction a unit distance that stands for an opacity of 1: opaque after 2e-5 of it.
constexpr double kOpaqueExtinction = 1e6;

// Where a table begins and how fine it is, without baking it.
struct TableSpan {
  float scale = 1;
  float first = 0;
};
TableSpan tableSpan(const TableRecipe& recipe, const VolumeInfo& info, std::size_t channel);

TransferTable bakeTransfer(const TableRecipe& recipe, const VolumeInfo& info, std::size_t channel);

}  // namespace blockwalk
