// SPDX-License-Identifier: Apache-2.0
// What is active of a VDB tree, in memory: leaves of 8^3 voxels with the values of the active ones, and cubes of one
// value. All else is background. Index space is the file's own: whole numbers of 32 bits, negative ones too.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "volume/import/convert/sample.h"
#include "volume/source.h"
#include "volume/voxel_box.h"

namespace blockwalk {

constexpr int kLeafSide = 8;
constexpr std::size_t kLeafVoxels = 512;
constexpr int kFarthest = 1 << 30;  // of index space, so that sums fit 32 bits

// Bit y * 8 + x of word z: the voxel at (x, y, z) of a leaf is active.
using LeafMask = std::array<std::uint64_t, kLeafSide>;

std::size_t activeVoxels(const LeafMask& mask);

// Corners of what is active, both with it; in 64 bits, as tiles may end beyond 32.
struct ActiveBox {
  glm::i64vec3 least{INT64_MAX};
  glm::i64vec3 greatest{INT64_MIN};

  bool empty() const { return least.x > greatest.x; }
  void add(const ActiveBox& other) {
    least = glm::min(least, other.least);
    greatest = glm::max(greatest, other.greatest);
  }
};

// Filled by addLeaf() and addTile() in any order, then finish(), then asked by any number of threads.
class SparseGrid {
 public:
  // Throws DataError, naming `name`, where more than `most_bytes` of memory would be taken.
  SparseGrid(const SampleFormat& format, std::span<const std::byte> background, std::uint64_t most_bytes,
             std::string name);

  // `origin` is a multiple of 8; `values` are those of the active voxels, x fastest.
  void addLeaf(glm::ivec3 origin, const LeafMask& mask, std::span<const std::byte> values);
  // An active cube of 2^log2_side voxels a side, which is 3, 7 or 12; `origin` is a multiple of that side.
  void addTile(glm::ivec3 origin, int log2_side, std::span<const std::byte> value);
  // Throws DataError where a leaf or a tile comes twice, where nothing is active, and where something lies beyond
  // kFarthest.
  void finish();

  const SampleFormat& format() const { return format_; }
  std::span<const std::byte> background() const { return background_; }
  const ActiveBox& box() const { return box_; }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t tileCount() const;
  std::uint64_t leafVoxelCount() const { return leaf_voxels_; }  // active ones
  std::uint64_t voxelCount() const { return voxels_; }           // with those that tiles cover

  // One component of the voxels of `box`, x fastest, as many samples; what is not active has the background.
  void read(const VoxelBox& box, int component, std::span<std::byte> out) const;
  // Adds runs of x outside of which nothing of the box is active. Says no more than whether there is anything where
  // the box is many leaves high.
  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) const;
  // Least and greatest sample of the active voxels in any component from `first` up to and without `last`, of those
  // that are finite; both 0 where there is none. Only of floats.
  std::array<double, 2> range(int first, int last) const;

 private:
  struct Leaf {
    glm::ivec3 cell{0};
    std::uint64_t first = 0;  // byte of its values
    LeafMask mask{};
  };
  struct Tile {
    glm::ivec3 cell{0};
    std::uint64_t first = 0;
  };
  // Values in pieces, so that none moves when there come more.
  std::uint64_t keep(std::span<const std::byte> values);
  const std::byte* at(std::uint64_t byte) const;
  void take(std::uint64_t bytes);
  void readLeaf(const Leaf& leaf, const VoxelBox& box, std::size_t sample, std::span<std::byte> out) const;

  SampleFormat format_;
  std::vector<std::byte> background_;
  std::uint64_t most_bytes_;
  std::string name_;
  std::uint64_t bytes_ = 0;
  std::uint64_t voxels_ = 0;
  std::uint64_t leaf_voxels_ = 0;
  ActiveBox box_;
  std::vector<Leaf> leaves_;                // ascending by z, y, x once finished
  std::array<std::vector<Tile>, 3> tiles_;  // of sides 8, 128 and 4096, likewise
  std::vector<std::vector<std::byte>> pieces_;
};

}  // namespace blockwalk
