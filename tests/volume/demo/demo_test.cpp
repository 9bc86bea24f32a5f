// SPDX-License-Identifier: Apache-2.0
#include "volume/demo/demo.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "volume/error.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

// Slice after slice, in a slice channel after channel.
std::vector<std::byte> readWhole(Source& source) {
  const SourceInfo& info = source.info();
  const std::size_t slice = channelRowBytes(info) * static_cast<std::size_t>(info.dims.y) * info.channels.size();
  std::vector<std::byte> all(slice * static_cast<std::size_t>(info.dims.z));
  for (int z = 0; z < info.dims.z; ++z) {
    source.readRows(z, 0, info.dims.y, std::span(all).subspan(static_cast<std::size_t>(z) * slice, slice));
  }
  return all;
}

struct Densities {
  double lowest = 0;  // of those above 0
  double highest = 0;
  double share = 0;  // above 0
  double share_above_130 = 0;
};

Densities densitiesOf(const SourceInfo& info, const std::vector<std::byte>& voxels) {
  Densities result{.lowest = 1e30};
  const std::size_t width = voxelBytes(info.type);
  const double voxel_share = static_cast<double>(width) / static_cast<double>(voxels.size());
  for (std::size_t i = 0; i < voxels.size(); i += width) {
    const auto density = static_cast<double>(storedDensity(info.type, &voxels[i]));
    if (density == 0) continue;
    result.lowest = std::min(result.lowest, density);
    result.highest = std::max(result.highest, density);
    result.share += voxel_share;
    result.share_above_130 += density >= 130 ? voxel_share : 0;
  }
  return result;
}

struct Expected {
  VoxelType type;
  glm::ivec3 dims;  // at size 192
  double least_share;
  double most_share;
  double highest;
};

Expected expectedOf(std::string_view name) {
  if (name == "fossil") return {VoxelType::rgba8, {192, 128, 90}, 0.4, 0.8, 255};
  if (name == "rock") return {VoxelType::rgba8, {192, 128, 163}, 0.3, 0.7, 255};
  if (name == "chip") return {VoxelType::rgba8, {192, 71, 41}, 0.02, 0.2, 255};
  if (name == "vessels") return {VoxelType::u8, {192, 192, 192}, 0.001, 0.03, 255};
  if (name == "cells") return {VoxelType::u16, {192, 144, 96}, 0.05, 0.3, 40000};
  if (name == "tissue") return {VoxelType::u16, {192, 192, 144}, 0.005, 0.05, 32200};
  if (name == "cosmos") return {VoxelType::u16, {192, 192, 192}, 0.001, 0.1, 65535};
  return {VoxelType::f32, {119, 192, 119}, 0.01, 0.3, 1};
}

class Demo : public testing::TestWithParam<std::string_view> {};

TEST_P(Demo, FillsItsBoxAsItShould) {
  const Expected expected = expectedOf(GetParam());
  const auto source = openDemo(GetParam(), 192);
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.name, GetParam());
  EXPECT_EQ(info.type, expected.type);
  EXPECT_EQ(info.dims, expected.dims);
  EXPECT_TRUE(info.random_access);
  const Densities found = densitiesOf(info, readWhole(*source));
  EXPECT_GE(found.share, expected.least_share);
  EXPECT_LE(found.share, expected.most_share);
  EXPECT_LE(found.highest, expected.highest);
  EXPECT_GE(found.highest, expected.highest * 0.9);
}

TEST_P(Demo, IsTheSameInWhateverOrderItIsRead) {
  const auto source = openDemo(GetParam(), 40);
  const std::vector<std::byte> forwards = readWhole(*source);
  const glm::ivec3 dims = source->info().dims;
  const std::size_t row = channelRowBytes(source->info());
  const std::size_t channels = source->info().channels.size();
  std::vector<std::byte> one(row * channels);
  for (int z = dims.z - 1; z >= 0; --z) {
    for (int y = dims.y - 1; y >= 0; --y) {
      source->readRows(z, y, 1, one);
      for (std::size_t channel = 0; channel < channels; ++channel) {
        const std::size_t first = (static_cast<std::size_t>(z) * channels + channel) * static_cast<std::size_t>(dims.y);
        const std::byte* wanted = &forwards[(first + static_cast<std::size_t>(y)) * row];
        ASSERT_EQ(std::memcmp(&one[channel * row], wanted, row), 0) << "row " << y << " of slice " << z;
      }
    }
  }
}

TEST_P(Demo, HasEverySize) {
  for (const int size : {1, 2, 3, 17, 33}) {
    const auto source = openDemo(GetParam(), size);
    const glm::ivec3 dims = source->info().dims;
    EXPECT_EQ(std::max({dims.x, dims.y, dims.z}), size);
    EXPECT_GE(std::min({dims.x, dims.y, dims.z}), 1);
    EXPECT_FALSE(readWhole(*source).empty());
  }
  // The largest one, in the middle: a row of it is all that is made.
  const auto largest = openDemo(GetParam(), kMaxDim);
  const glm::ivec3 dims = largest->info().dims;
  EXPECT_EQ(std::max({dims.x, dims.y, dims.z}), kMaxDim);
  std::vector<std::byte> row(channelRowBytes(largest->info()) * largest->info().channels.size());
  largest->readRows(dims.z / 2, dims.y / 2, 1, row);
}

INSTANTIATE_TEST_SUITE_P(All, Demo, testing::ValuesIn(demoNames().begin(), demoNames().end()),
                         [](const auto& instance) { return std::string(instance.param); });

TEST(DemoVolumes, AreTheSameOnEveryMachine) {
  const std::pair<std::string_view, std::uint64_t> hashes[] = {
      {"fossil", 0x780e61349b3e29e0ull},  {"rock", 0xfdee2c741f563fa3ull},   {"chip", 0x45077212e064fc66ull},
      {"vessels", 0x04cf3d8b64aaa856ull}, {"cells", 0x73fef82725750d13ull},  {"smoke", 0xfdada204e7993a2dull},
      {"tissue", 0xe2997019a80ca9a0ull},  {"cosmos", 0xcce7e2eb1ffac281ull},
  };
  for (const auto& [name, hash] : hashes) {
    const std::vector<std::byte> voxels = readWhole(*openDemo(name, 48));
    EXPECT_EQ(XXH3_64bits(voxels.data(), voxels.size()), hash) << name;
  }
}

TEST(DemoVolumes, TissueHasAMarkerInFewOfItsCells) {
  const auto source = openDemo("tissue", 160);
  const SourceInfo& info = source->info();
  ASSERT_EQ(info.channels.size(), 3u);
  EXPECT_EQ(info.channels[0].name, "nuclei");
  EXPECT_EQ(info.channels[1].name, "membranes");
  EXPECT_EQ(info.channels[2].name, "marker");
  const std::vector<std::byte> voxels = readWhole(*source);
  const std::size_t plane = channelRowBytes(info) * static_cast<std::size_t>(info.dims.y);
  std::array<std::size_t, 3> bright{};
  for (std::size_t i = 0; i < voxels.size(); i += 2) {
    bright[i / plane % 3] += storedDensity(VoxelType::u16, &voxels[i]) > 0 ? 1 : 0;
  }
  EXPECT_GT(bright[2], 0u);
  EXPECT_LT(bright[2] * 5, bright[0]);
  EXPECT_LT(bright[0], bright[1] * 5);
  EXPECT_LT(bright[1], bright[0] * 5);
}

// What the demo is for: raising the lower bound of the range takes the rock away and leaves the fossil.
TEST(DemoVolumes, TheFossilIsDenserThanItsRock) {
  const auto source = openDemo("fossil", 160);
  const std::vector<std::byte> voxels = readWhole(*source);
  const Densities found = densitiesOf(source->info(), voxels);
  EXPECT_GE(found.lowest, 15);
  EXPECT_GT(found.share_above_130, 0.02);
  EXPECT_LT(found.share_above_130, 0.1);
  std::size_t between = 0;
  for (std::size_t i = 3; i < voxels.size(); i += 4) {
    const int density = std::to_integer<int>(voxels[i]);
    between += density > 112 && density < 148 ? 1 : 0;
  }
  EXPECT_EQ(between, 0u) << "rock and fossil must not meet in density";
}

TEST(DemoVolumes, RefusesUnknownNamesAndSizes) {
  const auto message = [](std::string_view name, int size) -> std::string {
    try {
      openDemo(name, size);
    } catch (const DataError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(message("teapot", 64), HasSubstr("fossil, rock, chip"));
  EXPECT_THAT(message("fossil", 0), HasSubstr("1..65536"));
  EXPECT_THAT(message("fossil", 65537), HasSubstr("1..65536"));
  EXPECT_THAT(message("cosmos", 65537), HasSubstr("cosmos: size 65537 is outside 1..65536"));
}

}  // namespace
}  // namespace blockwalk
