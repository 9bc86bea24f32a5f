// SPDX-License-Identifier: Apache-2.0
// Several steps in time in one file: each is as it would be alone, and what is chosen for pictures is of all.
#include "volume/file/steps.h"
#include "volume/file/checksum.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

#include "tests/volume/file/broken_file.h"
#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/steps_builder.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

const BuildOptions kSmall{.subblock_side = 4, .block_side = 2};

// Steps of random volumes, of which the second is blank.
std::vector<MemorySource> sources(VoxelType type, std::size_t channels = 1) {
  std::vector<MemorySource> made;
  for (unsigned step = 0; step < 3; ++step) {
    made.push_back(step == 1 ? MemorySource(type, {41, 23, 19}, channels)
                             : randomSource(type, {41, 23, 19}, 7 + step, false, channels));
    for (std::size_t channel = 0; channel < channels && channels > 1; ++channel) {
      made.back().change().channels[channel].name = fmt::format("c{}", channel);
    }
  }
  return made;
}

void buildSteps(std::vector<MemorySource>& steps, const std::filesystem::path& path,
                const BuildOptions& options = kSmall) {
  StepsBuilder builder(path, static_cast<int>(steps.size()));
  for (MemorySource& step : steps) builder.add(step, options);
  const std::uint64_t bytes = builder.finish();
  EXPECT_EQ(bytes, std::filesystem::file_size(path));
}

std::uint64_t sumOf(const ChannelInfo& channel) {
  return std::accumulate(channel.histogram.begin(), channel.histogram.end(), std::uint64_t{0});
}

TEST(Steps, HoldTheVoxelsOfEachSource) {
  const ScratchFolder folder;
  for (const VoxelType type : {VoxelType::rgba8, VoxelType::u8, VoxelType::u16, VoxelType::f32}) {
    const std::size_t channels = type == VoxelType::u16 ? 2 : 1;
    std::vector<MemorySource> steps = sources(type, channels);
    buildSteps(steps, folder / "steps.bwv");
    const VolumeFile file(folder / "steps.bwv");
    ASSERT_EQ(file.info().steps, 3);
    EXPECT_EQ(file.step(), 0);
    for (int step = 0; step < 3; ++step) {
      const VolumeFile volume = file.atStep(step);
      EXPECT_EQ(volume.step(), step);
      EXPECT_EQ(volume.fileBytes(), std::filesystem::file_size(folder / "steps.bwv"));
      MemorySource& source = steps[static_cast<std::size_t>(step)];
      EXPECT_EQ(verifyVolume(source, volume), source.voxelCount());
      // Level by level the same as of a file of its own.
      buildVolume(source, folder / "alone.bwv", kSmall);
      const VolumeFile alone(folder / "alone.bwv");
      ASSERT_EQ(alone.info().steps, 1);
      for (int level = 0; level < static_cast<int>(alone.info().levels.size()); ++level) {
        EXPECT_EQ(readDense(volume, level).voxels, readDense(alone, level).voxels) << step << " level " << level;
      }
    }
  }
}

TEST(Steps, DensitiesAndHistogramsAreOfAll) {
  const ScratchFolder folder;
  for (const VoxelType type : {VoxelType::u8, VoxelType::u16, VoxelType::f32}) {
    std::vector<MemorySource> steps = sources(type);
    std::uint64_t nonempty = 0;
    float least = 0;
    float most = 0;
    for (const std::size_t i : {0u, 2u}) {
      buildVolume(steps[i], folder / "alone.bwv", kSmall);
      const ChannelInfo alone = VolumeFile(folder / "alone.bwv").info().channels[0];
      nonempty += alone.nonempty_voxels;
      least = i == 0 ? alone.density_min : std::min(least, alone.density_min);
      most = std::max(most, alone.density_max);
    }
    buildSteps(steps, folder / "steps.bwv");
    const VolumeFile file(folder / "steps.bwv");
    for (int step = 0; step < 3; ++step) {
      const ChannelInfo channel = file.atStep(step).info().channels[0];
      EXPECT_EQ(channel.density_min, least);
      EXPECT_EQ(channel.density_max, most);
      EXPECT_EQ(sumOf(channel), nonempty);
      EXPECT_EQ(channel.histogram, file.info().channels[0].histogram);
    }
  }
}

// The same values stored by other maps are the same densities in data units.
TEST(Steps, MayHaveOtherMapsOfValues) {
  const ScratchFolder folder;
  std::vector<MemorySource> steps;
  for (int step = 0; step < 2; ++step) {
    steps.emplace_back(VoxelType::u16, glm::ivec3(20, 20, 20));
    steps.back().change().channels[0].value_scale = step == 0 ? 1 : 0.25;
    steps.back().change().channels[0].value_offset = step == 0 ? 0 : -10;
  }
  for (int i = 0; i < 20; ++i) {
    steps[0].set<std::uint16_t>({i, 3, 4}, static_cast<std::uint16_t>(100 + i));       // 100..119
    steps[1].set<std::uint16_t>({i, 3, 4}, static_cast<std::uint16_t>(4 * (50 + i)));  // 40..59
  }
  buildSteps(steps, folder / "steps.bwv");
  const VolumeFile file(folder / "steps.bwv");
  for (int step = 0; step < 2; ++step) {
    const ChannelInfo channel = file.atStep(step).info().channels[0];
    EXPECT_DOUBLE_EQ(channel.dataFromStored(static_cast<double>(channel.density_min)), 40) << step;
    EXPECT_DOUBLE_EQ(channel.dataFromStored(static_cast<double>(channel.density_max)), 119) << step;
    EXPECT_EQ(sumOf(channel), 40u);
    // Halfway between the two there is nothing.
    const double lo = channel.dataFromStored(static_cast<double>(channel.histogram_lo));
    const double hi = channel.dataFromStored(static_cast<double>(channel.histogram_hi));
    const auto middle = static_cast<std::size_t>((80 - lo) / (hi - lo) * kHistogramBins);
    const std::uint64_t below = std::accumulate(
        channel.histogram.begin(), channel.histogram.begin() + static_cast<long>(middle), std::uint64_t{0});
    EXPECT_EQ(below, 20u);
  }
}

TEST(Steps, WhatIsNotOnTheFirstGridIsRefused) {
  const ScratchFolder folder;
  const auto fault = [&](MemorySource second) -> std::string {
    MemorySource first = randomSource(VoxelType::u8, {20, 20, 20}, 1);
    StepsBuilder builder(folder / "steps.bwv", 2);
    builder.add(first, kSmall);
    try {
      builder.add(second, kSmall);
    } catch (const DataError& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_THAT(fault(randomSource(VoxelType::u8, {20, 20, 21}, 2)),
              HasSubstr("step 1 has 1 channels of 20 x 20 x 21 u8, the first step 1 of 20 x 20 x 20 u8"));
  EXPECT_THAT(fault(randomSource(VoxelType::u16, {20, 20, 20}, 2)), HasSubstr("20 x 20 x 20 u16"));
  MemorySource moved = randomSource(VoxelType::u8, {20, 20, 20}, 2);
  moved.change().world_from_index[3].x = 0.5;
  EXPECT_THAT(fault(moved), HasSubstr("lies at another place"));
  moved.change().world_from_index[3].x = 1e-6;  // written in fewer digits
  EXPECT_EQ(fault(moved), "");
  EXPECT_FALSE(std::filesystem::exists(folder / "steps.bwv"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path));
}

// What is empty is each step's own: no value of a later step is lost because the first has none like it.
TEST(Steps, LoseNoValueThatTheFirstLacks) {
  const ScratchFolder folder;
  std::vector<MemorySource> steps;
  for (int step = 0; step < 2; ++step) {
    steps.emplace_back(VoxelType::f32, glm::ivec3(12));
    for (int i = 0; i < 12; ++i) steps.back().set<float>({i, i, i}, step == 1 ? -50.0f + static_cast<float>(i) : 7.0f);
  }
  buildSteps(steps, folder / "steps.bwv");
  const VolumeFile file(folder / "steps.bwv");
  EXPECT_EQ(file.info().channels[0].empty_threshold, 0);
  const VolumeFile second = file.atStep(1);
  EXPECT_EQ(second.info().channels[0].empty_threshold, -50);
  const DenseLevel dense = readDense(second, 0);
  EXPECT_EQ(
      std::memcmp(dense.voxels.data() + (5 + 12 * (5 + 12 * 5)) * sizeof(float), steps[1].at({5, 5, 5}), sizeof(float)),
      0);
  EXPECT_EQ(file.info().channels[0].density_min, second.info().channels[0].density_min);
}

// Light goes by what most voxels of all steps are at most: of alike steps it is that of one alone.
TEST(Steps, HaveTheLightOfOneWhereTheyAreAlike) {
  const ScratchFolder folder;
  std::vector<MemorySource> steps;
  for (int step = 0; step < 4; ++step) steps.push_back(randomSource(VoxelType::u16, {41, 23, 19}, 3));
  buildVolume(steps[0], folder / "alone.bwv", kSmall);
  const double alone = highDensity(VoxelType::u16, VolumeFile(folder / "alone.bwv").info().channels[0]);
  buildSteps(steps, folder / "steps.bwv");
  const VolumeFile file(folder / "steps.bwv");
  for (int step = 0; step < 4; ++step) {
    EXPECT_EQ(highDensity(VoxelType::u16, file.atStep(step).info().channels[0]), alone) << step;
  }
}

// Labels stay labels in each channel, and what is not is no guess.
TEST(Steps, ValuesAreWhatTheFirstsAre) {
  const ScratchFolder folder;
  const auto step = [](bool are_labels, unsigned seed) {
    MemorySource source(VoxelType::u8, {24, 24, 24});
    for (int i = 0; i < 24 * 24 * 24; ++i) {
      const glm::ivec3 p(i % 24, i / 24 % 24, i / 576);
      source.set<std::uint8_t>(
          p, static_cast<std::uint8_t>(are_labels ? 1 + p.x / 8 : 1 + (i * 7 + static_cast<int>(seed)) % 200));
    }
    return source;
  };
  BuildOptions guess = kSmall;
  guess.values = ValuesRule::guess;
  std::vector<MemorySource> labels{step(true, 0), step(true, 1)};
  buildSteps(labels, folder / "labels.bwv", guess);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(VolumeFile(folder / "labels.bwv").atStep(i).info().channels[0].values, ChannelValues::labels);
  }
  std::vector<MemorySource> mixed{step(true, 0), step(false, 1)};
  try {
    buildSteps(mixed, folder / "mixed.bwv", guess);
    FAIL();
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("--values intensity or labels"));
  }
  guess.values = ValuesRule::intensity;
  EXPECT_NO_THROW(buildSteps(mixed, folder / "mixed.bwv", guess));
}

// A file whose steps differ though each is right by itself.
TEST(Steps, OfOtherGridsAreNoFile) {
  const ScratchFolder folder;
  MemorySource small = randomSource(VoxelType::u8, {20, 20, 20}, 1);
  MemorySource large = randomSource(VoxelType::u8, {40, 20, 20}, 1);
  std::string bytes(kStepAlignment, '\0');
  Steps steps{.type = VoxelType::u8, .places = {}, .channels = {}};
  std::vector<ChannelInfo> channels;
  for (MemorySource* source : {&small, &large}) {
    buildVolume(*source, folder / "alone.bwv", kSmall);
    channels.push_back(VolumeFile(folder / "alone.bwv").info().channels[0]);
    bytes.resize((bytes.size() + kStepAlignment - 1) / kStepAlignment * kStepAlignment);
    const std::string alone = readBytes(folder / "alone.bwv");
    steps.places.push_back({.offset = bytes.size(), .bytes = alone.size()});
    bytes += alone;
  }
  steps.channels.push_back(overAllSteps(channels));
  const std::vector<std::byte> header = encodeSteps(steps, bytes.size());
  std::memcpy(bytes.data(), header.data(), header.size());
  writeBytes(folder / "steps.bwv", bytes);
  const VolumeFile file(folder / "steps.bwv");
  try {
    file.atStep(1);
    FAIL();
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("step 1"));
    EXPECT_THAT(error.what(), HasSubstr("is another grid than the first step's"));
  }
}

TEST(Steps, BrokenHeadersAreRefused) {
  const ScratchFolder folder;
  std::vector<MemorySource> steps = sources(VoxelType::u8);
  buildSteps(steps, folder / "steps.bwv");
  const std::string whole = readBytes(folder / "steps.bwv");
  const auto fault = [&](std::size_t at, const std::string& bytes, bool seals = true) {
    std::string broken = whole;
    broken.replace(at, bytes.size(), bytes);
    if (seals) {
      const auto header_bytes = stepsHeaderBytes(std::size_t{3}, 1);
      broken.replace(24, 8, std::string(8, '\0'));
      broken.replace(24, 8, raw(checksumOf(std::as_bytes(std::span(broken)).first(header_bytes))));
    }
    writeBytes(folder / "broken.bwv", broken);
    return messageOf(folder / "broken.bwv");
  };
  EXPECT_THAT(fault(8, raw(std::uint32_t{4})), HasSubstr("version"));
  EXPECT_THAT(fault(16, raw(std::uint64_t{1} << 40)), HasSubstr("file_bytes"));
  EXPECT_THAT(fault(24, raw(std::uint64_t{5}), false), HasSubstr("header_checksum"));
  EXPECT_THAT(fault(32, raw(std::uint32_t{0})), HasSubstr("step_count at offset 32 is 0, must be 1..16384"));
  EXPECT_THAT(fault(32, raw(std::uint32_t{0xffffffff})), HasSubstr("step_count"));
  EXPECT_THAT(fault(32, raw(std::uint32_t{2})), HasSubstr("header_bytes"));
  EXPECT_THAT(fault(36, raw(std::uint32_t{5})), HasSubstr("channel_count"));
  EXPECT_THAT(fault(40, raw(std::uint8_t{9})), HasSubstr("type"));
  EXPECT_THAT(fault(41, raw(std::uint8_t{9})), HasSubstr("reserved"));
  EXPECT_THAT(fault(48, raw(std::uint64_t{8192})), HasSubstr("step 0 offset"));
  EXPECT_THAT(fault(56, raw(~std::uint64_t{0})), HasSubstr("step 0 bytes"));
  EXPECT_THAT(fault(40, raw(std::uint8_t{3})), HasSubstr("the steps together 1 of u16"));
  expectTruncationsFail(whole, {.thorough = 200, .end = 20, .step = 1009});
}

TEST(Steps, FlippedBitsAreNoticed) {
  const ScratchFolder folder;
  std::vector<MemorySource> steps = sources(VoxelType::u8);
  buildSteps(steps, folder / "steps.bwv");
  const std::string whole = readBytes(folder / "steps.bwv");
  const std::size_t header = stepsHeaderBytes(std::size_t{3}, 1);
  for (std::size_t at = 0; at < header; at += 3) {
    std::string broken = whole;
    broken[at] = static_cast<char>(broken[at] ^ (1 << at % 8));
    writeBytes(folder / "flipped.bwv", broken);
    EXPECT_THROW(VolumeFile(folder / "flipped.bwv"), DataError) << at;
  }
}

// A build that ends before its last step leaves nothing.
TEST(Steps, AnUnfinishedFileHasNoName) {
  const ScratchFolder folder;
  {
    MemorySource first = randomSource(VoxelType::u8, {20, 20, 20}, 1);
    StepsBuilder builder(folder / "steps.bwv", 2);
    builder.add(first, kSmall);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path));
  EXPECT_THROW(StepsBuilder(folder / "steps.bwv", 1), DataError);
  EXPECT_THROW(StepsBuilder(folder / "steps.bwv", kMaxSteps + 1), DataError);
}

}  // namespace
}  // namespace blockwalk::volume_test
