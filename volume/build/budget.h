// SPDX-License-Identifier: Apache-2.0
// How a build divides its memory, and on how many threads it runs. Tests make the parts tiny to force every path
// through the disk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "volume/build/builder.h"
#include "volume/volume.h"

namespace blockwalk {

constexpr std::uint64_t kLeastMemoryBytes = std::uint64_t{64} << 20;

struct BuildBudget {
  int workers = 1;                // threads beside the one that builds, the same in all three passes
  std::uint64_t slab_bytes = 0;   // slices of a source without random access
  std::uint64_t sort_bytes = 0;   // records of level 0
  std::uint64_t spill_bytes = 0;  // subblocks of level 0 that need no file
  std::uint64_t scan_bytes = 0;   // strips that are read and cut at the same time, but for two which there always are
  std::size_t stream_bytes = 0;   // of each temporary stream, at most 8 a level, and of subblocks until they are sorted
  std::size_t shell_bytes = 0;    // of shells read again when aprons are found, which is after the sort
};

// Of one worker; what is in memory whatever the parts are comes on top.
inline BuildBudget budgetOf(std::uint64_t memory_bytes) {
  return {.slab_bytes = memory_bytes / 3,
          .sort_bytes = memory_bytes / 8,
          .spill_bytes = memory_bytes / 4,
          .scan_bytes = memory_bytes / 16,
          .stream_bytes = static_cast<std::size_t>(memory_bytes / 1024),
          .shell_bytes = static_cast<std::size_t>(memory_bytes / 16)};
}

// What `grid` (type, dims, sides, channels) takes at least: with one worker, so the machine has no say in it.
std::uint64_t leastMemoryBytes(const VolumeInfo& grid);

// At least leastMemoryBytes(), divided: as many workers as there are processors and memory for, and what is in memory
// whatever the parts are off the spill's. A source with random access needs no slab.
BuildBudget budgetOf(const VolumeInfo& grid, bool random_access, std::uint64_t memory_bytes, int processors);

// buildVolume() with another division of the memory and as many workers as that says.
BuildReport buildVolume(Source& source, const std::filesystem::path& path, const BuildOptions& options,
                        const BuildBudget& budget);

}  // namespace blockwalk
