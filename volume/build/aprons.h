// SPDX-License-Identifier: Apache-2.0
// What the file says of aprons: which subblocks have one that is not empty, and the densities between which
// interpolation inside them can give any value. Found without a second look at voxels: while a subblock passes by, its
// shell is kept, the range of densities in each of the 26 parts that a neighbour's apron takes from it.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "volume/build/shell.h"
#include "volume/build/storage.h"
#include "volume/build/workers.h"
#include "volume/file/layout.h"

namespace blockwalk {

// The shells of a level, in the order of its stored blocks, until its aprons are known.
class LevelShells {
 public:
  // `cache_bytes`: of shells in memory when they are read again.
  LevelShells(const std::filesystem::path& folder, std::size_t stream_bytes, std::size_t cache_bytes);

  // Every channel of one subblock of the block that is added next.
  void addSubblock(std::span<const std::byte> shells) { shells_.append(shells); }
  void addBlock(glm::ivec3 origin, const SubblockSet& stored);

  struct Aprons {
    std::uint64_t blocks = 0;
    std::uint64_t subblocks = 0;
  };
  // Appends block records of the level and, of each channel, apron ranges. `dims`: of the level. Memory: of each stored
  // block its StoredBlock (48 bytes) and its place (some 40), of those around them their codes, at most thrice 8 bytes;
  // the cache, of which each running job has its part, but 27 blocks' shells at least; and what two jobs for each
  // thread have found.
  Aprons find(const VolumeInfo& info, glm::ivec3 dims, TempBytes& blocks, std::span<TempBytes* const> apron_ranges,
              Workers& workers);

 private:
  TempBytes shells_;
  TempBytes blocks_;  // StoredBlock each
  std::size_t cache_bytes_;
  std::uint64_t subblocks_ = 0;
};

}  // namespace blockwalk
