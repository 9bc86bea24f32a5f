// SPDX-License-Identifier: Apache-2.0
// Channels whose values are labels: what their coarser levels hold, and when values are taken for labels.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"

namespace blockwalk::volume_test {
namespace {

template <typename T>
T voxelOf(const DenseLevel& dense, glm::ivec3 p) {
  const glm::ivec3 dims = dense.level.info.dims;
  const auto at = static_cast<std::size_t>(p.x + dims.x * (p.y + dims.y * p.z));
  T value{};
  std::memcpy(&value, dense.voxels.data() + at * sizeof(T), sizeof value);
  return value;
}

// The label that most children have, 0 (empty) being one; of as many, one that is not empty, then the least.
template <typename T>
T majorityOf(const DenseLevel& fine, glm::ivec3 coarse) {
  std::map<T, int> counts;
  for (int child = 0; child < 8; ++child) {
    const glm::ivec3 p = 2 * coarse + glm::ivec3(child & 1, child >> 1 & 1, child >> 2);
    if (glm::all(glm::lessThan(p, fine.level.info.dims))) ++counts[voxelOf<T>(fine, p)];
  }
  T best{};
  int most = counts.contains(T{}) ? counts[T{}] : 0;
  for (const auto& [value, count] : counts) {
    if (value != T{} && (count > most || (count == most && best == T{}))) {
      best = value;
      most = count;
    }
  }
  return best;
}

template <typename T>
void expectMajorities(MemorySource& source) {
  const ScratchFolder folder;
  buildVolume(source, folder / "labels.bwv", {.subblock_side = 4, .block_side = 2, .values = ValuesRule::labels});
  const VolumeFile file(folder / "labels.bwv");
  EXPECT_EQ(file.info().channels[0].values, ChannelValues::labels);
  ASSERT_GT(file.info().levels.size(), 2u);
  for (int level = 1; level < static_cast<int>(file.info().levels.size()); ++level) {
    const DenseLevel fine = readDense(file, level - 1);
    const DenseLevel coarse = readDense(file, level);
    const glm::ivec3 dims = coarse.level.info.dims;
    for (int i = 0; i < dims.x * dims.y * dims.z; ++i) {
      const glm::ivec3 p(i % dims.x, i / dims.x % dims.y, i / dims.x / dims.y);
      ASSERT_EQ(voxelOf<T>(coarse, p), majorityOf<T>(fine, p)) << level << ": " << p.x << ' ' << p.y << ' ' << p.z;
    }
  }
}

TEST(BuilderLabels, CoarserLevelsHoldTheMostFrequent) {
  std::mt19937 random(3);
  MemorySource bytes(VoxelType::u8, {45, 33, 27});
  for (std::byte& voxel : bytes.voxels) voxel = static_cast<std::byte>(random() % 4 * 60);
  expectMajorities<std::uint8_t>(bytes);
  MemorySource words(VoxelType::u16, {33, 20, 40});
  for (int i = 0; i < 33 * 20 * 40; ++i) {
    words.set<std::uint16_t>({i % 33, i / 33 % 20, i / 33 / 20}, static_cast<std::uint16_t>(random() % 3 * 30000));
  }
  expectMajorities<std::uint16_t>(words);
  MemorySource reals(VoxelType::f32, {33, 20, 40});
  for (int i = 0; i < 33 * 20 * 40; ++i) {
    const unsigned value = random() % 5;
    reals.set<float>({i % 33, i / 33 % 20, i / 33 / 20}, value == 4 ? std::nanf("") : static_cast<float>(value) * 2.5f);
  }
  // NaN is empty as 0 is, and a stored one counts as that.
  for (std::size_t at = 0; at < reals.voxels.size(); at += 4) {
    float value = 0;
    std::memcpy(&value, reals.voxels.data() + at, 4);
    if (std::isnan(value)) value = 0;
    std::memcpy(reals.voxels.data() + at, &value, 4);
  }
  expectMajorities<float>(reals);
}

TEST(BuilderLabels, NoLevelHoldsALabelThatIsNotInTheData) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {96, 96, 96});
  for (int i = 0; i < 96 * 96 * 96; ++i) {
    const glm::ivec3 p(i % 96, i / 96 % 96, i / 96 / 96);
    source.set<std::uint8_t>(p, (p.x / 3 + p.y / 3 + p.z / 3) % 2 == 0 ? 2 : 10);
  }
  buildVolume(source, folder / "checks.bwv", {.values = ValuesRule::guess});
  const VolumeFile file(folder / "checks.bwv");
  EXPECT_EQ(file.info().channels[0].values, ChannelValues::labels);
  for (int level = 0; level < static_cast<int>(file.info().levels.size()); ++level) {
    const DenseLevel dense = readDense(file, level);
    for (std::size_t at = 0; at < dense.voxels.size(); ++at) {
      const int value = std::to_integer<int>(dense.voxels[at]);
      ASSERT_TRUE(value == 2 || value == 10) << level << ": " << value;
    }
  }
}

ChannelValues guessOf(MemorySource& source, std::vector<double> empty = {}) {
  const ScratchFolder folder;
  return buildVolume(source, folder / "guess.bwv", {.empty_thresholds = std::move(empty), .values = ValuesRule::guess})
      .info.channels[0]
      .values;
}

TEST(BuilderLabels, AreGuessedFromFewValuesOrRegions) {
  std::mt19937 random(5);
  constexpr int kSide = 48;
  const auto fill = [](VoxelType type, auto valueAt) {
    MemorySource source(type, glm::ivec3(kSide));
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const glm::ivec3 p(i % kSide, i / kSide % kSide, i / kSide / kSide);
      const int value = valueAt(p);
      std::memcpy(source.at(p), &value, voxelBytes(type));
    }
    return source;
  };
  // Regions of 6 voxels with one of 300 numbers each.
  std::map<int, int> numbers;
  MemorySource atlas = fill(VoxelType::u16, [&](glm::ivec3 p) {
    const int region = p.x / 6 + 8 * (p.y / 6 + 8 * (p.z / 6));
    if (!numbers.contains(region)) numbers[region] = static_cast<int>(random() % 300);
    return numbers[region];
  });
  EXPECT_EQ(guessOf(atlas), ChannelValues::labels);
  MemorySource noise = fill(VoxelType::u8, [&](glm::ivec3) { return static_cast<int>(random() % 256); });
  EXPECT_EQ(guessOf(noise), ChannelValues::intensity);
  MemorySource smooth = fill(VoxelType::u8, [&](glm::ivec3 p) { return 10 + p.x / 2 + p.y + p.z; });
  EXPECT_EQ(guessOf(smooth), ChannelValues::intensity);
  MemorySource slope = fill(VoxelType::u8, [&](glm::ivec3 p) { return 10 + p.x / 6; });
  EXPECT_EQ(guessOf(slope), ChannelValues::labels);  // eight values: a guess that --values overrides
  MemorySource mask = fill(VoxelType::u8, [&](glm::ivec3 p) { return p.x > 20 ? 255 : 0; });
  EXPECT_EQ(guessOf(mask), ChannelValues::intensity);
  MemorySource nothing(VoxelType::u8, {9, 9, 9});
  EXPECT_EQ(guessOf(nothing), ChannelValues::intensity);
  // A scan whose air is far below the threshold, and even: what is empty says nothing.
  MemorySource scan =
      fill(VoxelType::u8, [&](glm::ivec3 p) { return p.x < 6 ? 21 + static_cast<int>(random() % 200) : 0; });
  EXPECT_EQ(guessOf(scan, {20}), ChannelValues::intensity);
  MemorySource reals = fill(VoxelType::f32, [&](glm::ivec3) { return 0x3f800000; });
  EXPECT_EQ(guessOf(reals), ChannelValues::intensity);
}

TEST(BuilderLabels, AreNoColours) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::rgba8, {9, 9, 9});
  EXPECT_THROW(buildVolume(source, folder / "color.bwv", {.values = ValuesRule::labels}), DataError);
  EXPECT_EQ(buildVolume(source, folder / "color.bwv", {.values = ValuesRule::guess}).info.channels[0].values,
            ChannelValues::intensity);
}

}  // namespace
}  // namespace blockwalk::volume_test
