// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/aproned_layout.h"

#include <algorithm>
#include <cstring>

namespace blockwalk {
namespace {

constexpr std::size_t kWordVoxels = 4;
constexpr std::size_t kWordStep = kWordVoxels - 1;

std::size_t rowVoxels(const VolumeInfo& info) { return static_cast<std::size_t>(info.subblock_side) + 2; }

// Of a row's interpolation cells, one fewer than its voxels, a word holds as many as it steps.
std::size_t rowWords(const VolumeInfo& info) { return (rowVoxels(info) - 1 + kWordStep - 1) / kWordStep; }

bool hasWords(const VolumeInfo& info) { return info.type == VoxelType::u8 || info.type == VoxelType::u16; }

}  // namespace

std::uint64_t apronedSubblockBytes(const VolumeInfo& info) {
  const std::size_t rows = rowVoxels(info) * rowVoxels(info);
  return rows * (hasWords(info) ? kWordVoxels * rowWords(info) : rowVoxels(info)) * voxelBytes(info.type);
}

void layOutAproned(const VolumeInfo& info, std::span<const std::byte> subblocks, std::span<std::byte> out) {
  if (!hasWords(info)) {
    std::ranges::copy(subblocks, out.begin());
    return;
  }
  const std::size_t bytes = voxelBytes(info.type);
  const std::size_t voxels = rowVoxels(info);
  const std::size_t words = rowWords(info);
  std::byte* to = out.data();
  for (std::size_t row = 0; row < subblocks.size(); row += voxels * bytes) {
    const std::byte* from = subblocks.data() + row;
    for (std::size_t word = 0; word < words; ++word) {
      for (std::size_t i = 0; i < kWordVoxels; ++i, to += bytes) {
        std::memcpy(to, from + std::min(kWordStep * word + i, voxels - 1) * bytes, bytes);
      }
    }
  }
}

}  // namespace blockwalk
