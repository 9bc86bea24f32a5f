// SPDX-License-Identifier: Apache-2.0
// Records of a window are those of the whole level that lie in it, and lead to the same voxels.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>

#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"
#include "volume/file/apron.h"
#include "volume/file/file.h"

namespace blockwalk::volume_test {
namespace {

constexpr glm::ivec3 kDims{70, 66, 62};

// Blocks of 4 voxels, 5000 of them and more: several groups of records.
std::filesystem::path sparseFile(const ScratchFolder& folder, VoxelType type, int block_side = 1) {
  MemorySource source(type, kDims);
  std::mt19937 random(5);
  const std::size_t bytes = voxelBytes(type);
  for (std::size_t i = 0; i < source.voxels.size(); i += bytes) {
    if (random() % 40 != 0) continue;
    for (std::size_t byte = 0; byte < bytes; ++byte)
      source.voxels[i + byte] = static_cast<std::byte>(1 + random() % 255);
  }
  const std::filesystem::path path = folder / "sparse.bwv";
  buildVolume(source, path, {.subblock_side = 4, .block_side = block_side});
  return path;
}

std::vector<BlockWindow> windows() {
  std::vector<BlockWindow> some{
      {},
      {.begin = {0, 0, 0}, .end = {1, 1, 1}},
      {.begin = {17, 16, 15}, .end = {99, 99, 99}},
      {.begin = {-5, -5, -5}, .end = {9, 1, 40}},
      {.begin = {3, 3, 3}, .end = {3, 9, 9}},
      {.begin = {40, 0, 0}, .end = {50, 9, 9}},
  };
  std::mt19937 random(9);
  const auto place = [&] { return static_cast<int>(random() % 20) - 1; };
  while (some.size() < 40) {
    const glm::ivec3 a(place(), place(), place());
    const glm::ivec3 b(place(), place(), place());
    some.push_back({.begin = glm::min(a, b), .end = glm::max(a, b)});
  }
  return some;
}

void expectSame(const Subblock& a, const Subblock& b) {
  EXPECT_EQ(a.density_min, b.density_min);
  EXPECT_EQ(a.density_max, b.density_max);
  EXPECT_EQ(a.range_mask, b.range_mask);
}

// The blocks of `whole` inside, one by one those of `part`; returns how many.
std::size_t expectPart(const Level& whole, const Level& part, const BlockWindow& window) {
  std::size_t at = 0;
  for (const Block& block : whole.blocks) {
    if (!window.contains(block.origin)) continue;
    if (at == part.blocks.size()) {
      ADD_FAILURE() << "a block is missing";
      return at;
    }
    const Block& found = part.blocks[at++];
    EXPECT_EQ(found.origin, block.origin);
    EXPECT_EQ(found.occupancy, block.occupancy);
    EXPECT_EQ(found.stored, block.stored);
    EXPECT_EQ(found.first_stored, block.first_stored);
    EXPECT_EQ(found.range_mask, block.range_mask);
    for (std::size_t i = 0; i < block.subblock_count; ++i) {
      expectSame(part.subblocks.at(found.first_subblock + i), whole.subblocks[block.first_subblock + i]);
    }
    for (std::size_t face = 0; face < 6; ++face) {
      glm::ivec3 beside = block.origin;
      beside[static_cast<int>(face / 2)] += face % 2 == 0 ? -1 : 1;
      const bool there = block.neighbours[face] != kNoBlock && window.contains(beside);
      EXPECT_EQ(found.neighbours[face] != kNoBlock, there);
      if (!there) continue;
      EXPECT_EQ(part.blocks.at(found.neighbours[face]).origin, beside);
    }
  }
  EXPECT_EQ(at, part.blocks.size());
  EXPECT_EQ(part.info.block_count, part.blocks.size());
  EXPECT_EQ(part.info.subblock_count, part.subblocks.size());
  return at;
}

class Windows : public ::testing::TestWithParam<VoxelType> {};

TEST_P(Windows, RecordsAreThoseOfTheWholeLevel) {
  const ScratchFolder folder;
  const VolumeFile file(sparseFile(folder, GetParam()));
  ASSERT_GT(file.info().levels[0].block_count, 3000u);
  std::size_t seen = 0;
  for (int level = 0; level < 3; ++level) {
    const Level stored = file.readLevel(level, 0);
    const Level apron = file.readApronLevel(level, 0);
    for (const BlockWindow& window : windows()) {
      seen += expectPart(stored, file.readLevel(level, 0, Form::values, window), window);
      expectPart(apron, file.readApronLevel(level, 0, Form::values, window), window);
    }
  }
  EXPECT_GT(seen, 10000u);
}

TEST_P(Windows, VoxelsWithTheirApronsAreThoseOfTheWholeLevel) {
  const ScratchFolder folder;
  const VolumeFile file(sparseFile(folder, GetParam()));
  ApronLevel whole(file, 0, 0);
  const auto codeOf = [](const Block& block) { return mortonCode(glm::uvec3(block.origin)); };
  for (const BlockWindow& window : windows()) {
    ApronLevel part(file, 0, 0, Form::values, 0, window);
    for (std::size_t i = 0; i < part.records().blocks.size(); i += 7) {
      const Block& block = part.records().blocks[i];
      const auto same = std::ranges::lower_bound(whole.records().blocks, codeOf(block), {}, codeOf);
      ASSERT_EQ(same->origin, block.origin);
      std::vector<std::byte> voxels(block.subblock_count * part.subblockBytes());
      std::vector<std::byte> expected(voxels.size());
      part.readBlock(i, voxels);
      whole.readBlock(static_cast<std::size_t>(same - whole.records().blocks.begin()), expected);
      ASSERT_EQ(voxels, expected) << "block " << block.origin.x << ' ' << block.origin.y << ' ' << block.origin.z;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Windows, ::testing::Values(VoxelType::u8, VoxelType::u16, VoxelType::rgba8));

// The file is changed under an open descriptor, anywhere in its records: no window takes what is not right. Where
// blocks have several subblocks one more or less of them can be said, inside of the window and where it passes by.
class ChangedFile : public ::testing::TestWithParam<int> {};

TEST_P(ChangedFile, AChangedGroupIsRefused) {
  const ScratchFolder folder;
  const int side = GetParam();
  const std::filesystem::path path = sparseFile(folder, VoxelType::u8, side);
  const VolumeFile file(path);
  const BlockWindow window{.begin = glm::ivec3(4 / side), .end = glm::ivec3(9 / side)};
  const Level right = file.readLevel(0, 0, Form::values, window);
  const std::uint64_t before = file.bytesRead();
  EXPECT_EQ(file.readLevel(0, 0, Form::values, window).blocks.size(), right.blocks.size());
  EXPECT_LT(file.bytesRead() - before, file.fileBytes() / (side == 1 ? 4 : 1))
      << "groups that are not met are not read";
  const Level apron = file.readApronLevel(0, 0, Form::values, window);

  std::fstream bytes(path, std::ios::in | std::ios::out | std::ios::binary);
  int refused = 0;
  for (std::uint64_t at = 0; at < file.fileBytes(); at += side == 1 ? 997 : 61) {
    char byte = 0;
    bytes.seekg(static_cast<std::streamoff>(at));
    bytes.get(byte);
    const auto put = [&](char value) {
      bytes.seekp(static_cast<std::streamoff>(at));
      bytes.put(value);
      bytes.flush();
    };
    put(static_cast<char>(byte ^ (1 << at % 8)));
    try {
      const Level level = file.readLevel(0, 0, Form::values, window);
      EXPECT_EQ(expectPart(right, level, {}), right.blocks.size());
      EXPECT_EQ(expectPart(apron, file.readApronLevel(0, 0, Form::values, window), {}), apron.blocks.size());
    } catch (const DataError& error) {
      EXPECT_NE(std::string(error.what()).find("sparse.bwv: level 0"), std::string::npos) << error.what();
      ++refused;
    }
    put(byte);
  }
  EXPECT_GT(refused, 3);
}

INSTANTIATE_TEST_SUITE_P(Sides, ChangedFile, ::testing::Values(1, 3));

}  // namespace
}  // namespace blockwalk::volume_test
