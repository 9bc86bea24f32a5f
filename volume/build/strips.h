// SPDX-License-Identifier: Apache-2.0
// A source as strips: one row of subblocks, side x side rows of voxels along all of x.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "volume/build/storage.h"
#include "volume/source.h"

namespace blockwalk {

// The voxels of a strip, or of a part of it, that lie inside the volume: [channel][z][y][x], x fastest.
struct Strip {
  glm::ivec3 begin{0};   // its first voxel, which is a subblock's
  glm::ivec3 extent{0};  // voxels
  std::size_t channels = 1;
  std::span<const std::byte> voxels;

  std::span<const std::byte> channel(std::size_t index) const {
    return voxels.subspan(index * (voxels.size() / channels), voxels.size() / channels);
  }
};

class StripReader {
 public:
  // A source without random access is collected slab by slab (`side` slices): in memory up to `slab_bytes`, else in a
  // temporary file in `folder`.
  StripReader(Source& source, int side, std::uint64_t slab_bytes, const std::filesystem::path& folder);

  glm::ivec3 strips() const { return {1, (dims_.y + side_ - 1) / side_, (dims_.z + side_ - 1) / side_}; }
  // Strip `y` of slab `z`, in ascending (z, y) without gaps; its voxels lie in `voxels`.
  Strip read(int z, int y, std::vector<std::byte>& voxels);

 private:
  void collectSlab(int z);
  void readDirect(int z, int y, int rows, std::size_t slice, std::size_t slices, std::span<std::byte> strip);
  void readSlab(int y, int rows, std::size_t slice, std::size_t slices, std::span<std::byte> strip) const;

  Source& source_;
  glm::ivec3 dims_;
  std::size_t channels_;
  int side_;
  std::uint64_t row_bytes_;  // of one channel
  int group_rows_;           // asked of the source at once for a slab, whole strips
  bool direct_ = false;      // strips come straight from the source
  TempBytes slab_;
  std::vector<std::byte> rows_;
};

}  // namespace blockwalk
