// SPDX-License-Identifier: Apache-2.0
// What must be resident for a frame, as data. A need says all that its part depends on: whoever needs the same shares
// it, whatever else his view shows.
#pragma once

#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include "view/view.h"
#include "volume/volume.h"

namespace blockwalk {

// Inclusive range of stored densities that can be seen; lo > hi when none can.
struct StoredRange {
  float lo = 0;
  float hi = 0;
  bool operator==(const StoredRange&) const = default;
};

// Kinds of what is resident.
enum class Part : std::uint8_t {
  voxels,            // of a channel of a level
  blocks,            // the kernel's records of its blocks, with the addresses of the voxels
  masks,             // minimum, maximum and range mask of its subblocks
  visible_quarters,  // which quarters of those may show something in a range
  empty,             // one subblock that is empty everywhere
  table,             // a transfer function, baked
  grid,              // what finders look in, of a level
  octree,
  instances,
  macrocells,  // ranges of a channel in macrocells
  clusters,    // the active ones of those: as boxes, or the triangles around them
  boundary,
  sums,       // of samples: what a refinement goes on with
  ancestors,  // for each block of a paged level, the block of a coarser one that covers it
};
constexpr int kPartKinds = static_cast<int>(Part::ancestors) + 1;

// As reports name them: voxels, blocks, masks, quarters, ...
std::string_view partName(Part part);

// What a baked transfer function is made of (renderer/plan/transfer_table.h).
struct TableRecipe {
  StoredRange range;
  std::vector<TransferPoint> transfer;
  TransferShape shape = TransferShape::linear;
  bool exact = false;                                        // an entry for every stored value
  bool mixes_empties = false;                                // what is looked up may be a mean with empty voxels
  double reaches = std::numeric_limits<double>::infinity();  // what is looked up may be as low, stored units
  bool integrals = false;                                    // for pre-integration
  bool operator==(const TableRecipe&) const = default;
};

// A channel drawn, and what can be seen of it.
struct RegionChannel {
  int channel = 0;
  std::uint8_t range_mask = 0;
  std::vector<StoredRange> densities;  // visibleDensities()
  bool operator==(const RegionChannel&) const = default;
};

// Of the members only those that the part depends on are set.
struct Need {
  static constexpr int kAllChannels = -1;

  Part part = Part::voxels;
  int level = 0;
  Form form = Form::values;
  BlockWindow window{};        // of the level's blocks; all of them unless their records are too many
  bool paged = false;          // voxels that come and go block by block, and what is made of those
  bool apron = false;          // voxels with the apron around every subblock, and what is made of those
  int channel = kAllChannels;  // of the volume
  StoredRange range{};         // visible_quarters: as densities are on the device
  bool of_blocks = false;      // octree: the leaves are blocks, not subblocks
  int macrocell_voxels = 0;    // macrocells, clusters, boundary: side of one
  TableRecipe table{};
  std::vector<RegionChannel> region{};  // clusters, boundary
  std::uint64_t owner = 0;              // sums
  int coarse_level = 0;                 // ancestors: of what covers
  Form coarse_form = Form::values;
  bool operator==(const Need&) const = default;
};

}  // namespace blockwalk
