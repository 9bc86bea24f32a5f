// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/aproned_layout.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::size_t kWordVoxels = 4;
constexpr std::size_t kWordStep = kWordVoxels - 1;

std::size_t rowVoxels(const VolumeInfo& info) { return static_cast<std::size_t>(info.subblock_side) + 2; }

// Of a row's interpolation cells, one fewer than its voxels, a word holds as many as it steps.
std::size_t rowWords(const VolumeInfo& info) { return (rowVoxels(info) - 1 + kWordStep - 1) / kWordStep; }

bool hasWords(const VolumeInfo& info) { return info.type == VoxelType::u8 || info.type == VoxelType::u16; }

// Rows of `side` + 2 voxels.
template <typename T, std::size_t side>
void layOutRows(std::span<const std::byte> subblocks, std::span<std::byte> out) {
  constexpr std::size_t kVoxels = side + 2;
  constexpr std::size_t kWords = (kVoxels - 1 + kWordStep - 1) / kWordStep;
  std::array<T, kWordStep * kWords + 1> row;
  std::byte* to = out.data();
  for (std::size_t at = 0; at < subblocks.size(); at += kVoxels * sizeof(T)) {
    std::memcpy(row.data(), subblocks.data() + at, kVoxels * sizeof(T));
    std::fill(row.begin() + kVoxels, row.end(), row[kVoxels - 1]);
    for (std::size_t word = 0; word < kWords; ++word, to += kWordVoxels * sizeof(T)) {
      std::memcpy(to, &row[kWordStep * word], kWordVoxels * sizeof(T));
    }
  }
}

template <typename T>
void layOut(int side, std::span<const std::byte> subblocks, std::span<std::byte> out) {
  switch (side) {
    case 4:
      return layOutRows<T, 4>(subblocks, out);
    case 8:
      return layOutRows<T, 8>(subblocks, out);
    default:
      BLOCKWALK_CHECK(side, ==, 16);
      return layOutRows<T, 16>(subblocks, out);
  }
}

}  // namespace

std::uint64_t apronedSubblockBytes(const VolumeInfo& info) {
  const std::size_t rows = rowVoxels(info) * rowVoxels(info);
  return rows * (hasWords(info) ? kWordVoxels * rowWords(info) : rowVoxels(info)) * voxelBytes(info.type);
}

void layOutAproned(const VolumeInfo& info, std::span<const std::byte> subblocks, std::span<std::byte> out) {
  if (!hasWords(info)) {
    std::ranges::copy(subblocks, out.begin());
  } else if (info.type == VoxelType::u8) {
    layOut<std::uint8_t>(info.subblock_side, subblocks, out);
  } else {
    layOut<std::uint16_t>(info.subblock_side, subblocks, out);
  }
}

}  // namespace blockwalk
