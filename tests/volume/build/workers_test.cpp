// SPDX-License-Identifier: Apache-2.0
// A build on several threads gives the bytes that it gives on one, and fails as it does.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <limits>
#include <memory>
#include <system_error>
#include <thread>

#include "tests/volume/memory_source.h"
#include "volume/build/budget.h"
#include "volume/build/builder.h"
#include "volume/error.h"
#include "volume/import/import.h"

namespace blockwalk::volume_test {
namespace {

constexpr int kSeveral = 4;
constexpr glm::ivec3 kDims{250, 170, 61};  // several batches of strips, and cut subblocks on every side

// Each worker has a source of its own. Slices from `broken` on cannot be read.
class SharedSource final : public Source {
 public:
  explicit SharedSource(std::shared_ptr<MemorySource> voxels, int broken = kMaxDim)
      : voxels_(std::move(voxels)), broken_(broken), info_(voxels_->info()) {}
  const SourceInfo& info() const override { return info_; }
  std::unique_ptr<Source> another() const override {
    ++others_;
    return std::make_unique<SharedSource>(voxels_, broken_);
  }
  int others() const { return others_; }
  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    if (z >= broken_) failData("slice {} is broken", z);
    const std::size_t row = channelRowBytes(info_);
    const std::size_t plane = row * static_cast<std::size_t>(count);
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      std::memcpy(out.data() + channel * plane, voxels_->at({0, y, z}, channel), plane);
    }
  }

 private:
  std::shared_ptr<MemorySource> voxels_;
  int broken_;
  SourceInfo info_;
  mutable int others_ = 0;
};

std::shared_ptr<MemorySource> denseSource(VoxelType type, std::size_t channels = 1) {
  auto source = std::make_shared<MemorySource>(randomSource(type, kDims, 5, true, channels));
  if (type == VoxelType::f32) return source;
  std::mt19937 random(9);
  for (std::size_t i = 0; i < source->voxels.size() / 2; ++i) source->voxels[i] = static_cast<std::byte>(random());
  return source;
}

// On one processor too.
BuildBudget budgetOf(int workers) {
  BuildBudget budget = blockwalk::budgetOf(BuildOptions{}.memory_bytes);
  budget.workers = workers;
  return budget;
}

std::string built(Source& source, const std::filesystem::path& path, const BuildOptions& options,
                  const BuildBudget& budget) {
  buildVolume(source, path, options, budget);
  return readBytes(path);
}

TEST(BuilderWorkers, OneThreadAndSeveralGiveTheSameBytes) {
  const BuildOptions options{.values = ValuesRule::guess};
  const ScratchFolder folder;
  for (const VoxelType type : {VoxelType::rgba8, VoxelType::u8, VoxelType::u16, VoxelType::f32}) {
    SCOPED_TRACE(voxelTypeName(type));
    const auto voxels = denseSource(type, type == VoxelType::u16 ? 2 : 1);
    SharedSource shared(voxels);
    const std::string expected = built(*voxels, folder / "one.bwv", options, budgetOf(1));
    EXPECT_EQ(built(*voxels, folder / "read.bwv", options, budgetOf(kSeveral)), expected) << "read by one thread";
    EXPECT_EQ(built(shared, folder / "shared.bwv", options, budgetOf(kSeveral)), expected) << "read by several";
    EXPECT_EQ(verifyVolume(shared, folder / "shared.bwv"), voxels->voxelCount());
    BuildBudget budget = budgetOf(kSeveral);
    budget.spill_bytes = std::uint64_t{1} << 20;
    EXPECT_EQ(built(shared, folder / "spill.bwv", options, budget), expected) << "spill in memory and in a file";
    buildVolume(shared, folder / "machine.bwv", options);
    EXPECT_EQ(readBytes(folder / "machine.bwv"), expected) << "as many as this machine has";
  }
}

// Tens of thousands of blocks: many jobs of what a block takes beside its voxels.
TEST(BuilderWorkers, BlocksOfOneSubblockAreTheSameBytes) {
  const ScratchFolder folder;
  SharedSource source(denseSource(VoxelType::u8));
  const BuildOptions options{.subblock_side = 4, .block_side = 1};
  const std::string expected = built(source, folder / "one.bwv", options, budgetOf(1));
  EXPECT_EQ(built(source, folder / "several.bwv", options, budgetOf(kSeveral)), expected);
}

// Counts of 16 bits take half a MiB a channel, more than a quarter of what a worker needs to read and cut.
TEST(BuilderWorkers, ReadersAndTheirCountsHaveTheMemoryThatIsTheirs) {
  const ScratchFolder folder;
  SharedSource source(denseSource(VoxelType::u16, 2));
  BuildBudget budget = budgetOf(8);
  buildVolume(source, folder / "many.bwv", {}, budget);
  ASSERT_GE(source.others(), 8) << "strips for many readers";
  const int before = source.others();
  budget.scan_bytes = std::uint64_t{8} << 20;
  buildVolume(source, folder / "fitting.bwv", {}, budget);
  const int readers = source.others() - before;
  EXPECT_GE(readers, 2);
  constexpr std::uint64_t kEach = (std::uint64_t{1} << 20) + 2 * 65536 * sizeof(std::uint64_t);
  EXPECT_LE(static_cast<std::uint64_t>(readers) * kEach, budget.scan_bytes);
}

TEST(BuilderWorkers, WhatAWorkerCannotReadIsToldAsWithOneThread) {
  const ScratchFolder folder;
  const auto voxels = denseSource(VoxelType::u8);
  for (const int workers : {1, kSeveral}) {
    for (const int broken : {0, 1, 23, kDims.z - 1}) {
      SharedSource source(voxels, broken);
      try {
        buildVolume(source, folder / "broken.bwv", {}, budgetOf(workers));
        FAIL() << "slice " << broken << " was read";
      } catch (const DataError& error) {
        EXPECT_EQ(std::string(error.what()), "slice " + std::to_string(broken) + " is broken");
      }
    }
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path));
}

TEST(BuilderWorkers, CancelledFromTheCallingThreadInEveryStep) {
  const ScratchFolder folder;
  SharedSource source(denseSource(VoxelType::u8));
  for (const std::string_view cancelled : {"read", "build levels", "write"}) {
    BuildOptions options;
    options.progress = [cancelled, caller = std::this_thread::get_id()](std::string_view step, std::uint64_t,
                                                                        std::uint64_t) {
      EXPECT_EQ(std::this_thread::get_id(), caller) << step;
      if (step == cancelled) throw std::runtime_error("cancelled");
    };
    EXPECT_THROW(buildVolume(source, folder / "cancelled.bwv", options, budgetOf(kSeveral)), std::runtime_error)
        << cancelled;
    EXPECT_TRUE(std::filesystem::is_empty(folder.path)) << cancelled;
  }
}

TEST(BuilderWorkers, ProgressEndsWithAllThereIs) {
  const ScratchFolder folder;
  SharedSource source(denseSource(VoxelType::u8));
  std::uint64_t rows = 0;
  BuildOptions options;
  options.progress = [&rows](std::string_view step, std::uint64_t done, std::uint64_t total) {
    if (step != "read") return;
    EXPECT_GT(done, rows);
    EXPECT_EQ(total, static_cast<std::uint64_t>(kDims.y * kDims.z));
    rows = done;
  };
  buildVolume(source, folder / "all.bwv", options, budgetOf(kSeveral));
  EXPECT_EQ(rows, static_cast<std::uint64_t>(kDims.y * kDims.z));
}

// A limit on the length of files stands for a full disk: first the spill's, which workers write, then the result's.
TEST(BuilderWorkers, AFullDiskIsTold) {
  const ScratchFolder folder;
  SharedSource source(denseSource(VoxelType::u8));
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit low = before;
  low.rlim_cur = 1 << 19;
  for (const std::uint64_t spill : {std::uint64_t{0}, std::uint64_t{1} << 30}) {
    BuildBudget budget = budgetOf(kSeveral);
    budget.spill_bytes = spill;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &low), 0);
    EXPECT_THROW(buildVolume(source, folder / "full.bwv", {}, budget), std::system_error) << spill;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path));
  }
  std::signal(SIGXFSZ, handler);
}

TEST(BuilderWorkersDeathTest, SourcesOfTheirOwnAreReadInAnyOrder) {
  const ScratchFolder folder;
  const auto voxels = denseSource(VoxelType::u8);
  voxels->change().random_access = false;
  SharedSource source(voxels);
  EXPECT_DEATH(buildVolume(source, folder / "order.bwv", {}, budgetOf(kSeveral)), "check failed.*random_access");
}

// Of each reader its part: as many and as large as one reader finds.
TEST(BuilderWorkers, ConversionIsReportedOfAllReaders) {
  const ScratchFolder folder;
  constexpr int kSide = 80;  // 4 MB
  std::vector<double> values(kSide * kSide * kSide);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(i % 1000) / 7;
  for (std::size_t i = 0; i < values.size(); i += 5000) values[i] = std::numeric_limits<double>::quiet_NaN();
  values[values.size() - 7] = 12345.6789;
  writeBytes(folder / "reals.raw", {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)});
  ImportOptions options;
  options.dims = glm::ivec3(kSide);
  options.type = "f64";
  const auto source = openSource({folder / "reals.raw"}, options);
  const VolumeInfo info = buildVolume(*source, folder / "reals.bwv", {}, budgetOf(kSeveral)).info;
  EXPECT_EQ(info.channels[0].nonfinite_voxels, (values.size() + 4999) / 5000);
  EXPECT_EQ(info.channels[0].largest_rounding, std::abs(12345.6789 - static_cast<double>(12345.6789f)));
}

}  // namespace
}  // namespace blockwalk::volume_test
