// SPDX-License-Identifier: Apache-2.0
// A source that says where it is blank gives the file of one that yields it all, and is not asked for what is blank.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>

#include "tests/volume/allocations.h"
#include "tests/volume/memory_source.h"
#include "volume/build/budget.h"
#include "volume/build/builder.h"
#include "volume/error.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

// The voxels of another; all that differ from `blank` lie in its runs, and by turns some more.
class BlankSource final : public Source {
 public:
  BlankSource(std::shared_ptr<MemorySource> voxels, std::vector<std::byte> blank)
      : voxels_(std::move(voxels)), info_(voxels_->info()) {
    info_.blank = std::move(blank);
  }

  const SourceInfo& info() const override { return info_; }
  std::unique_ptr<Source> another() const override { return std::make_unique<BlankSource>(voxels_, info_.blank); }
  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    readBox({.begin = {0, y, z}, .end = {info_.dims.x, y + count, z + 1}}, out);
  }

  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override {
    runs.clear();
    const int more = (box.begin.x + box.begin.y + box.begin.z) % 3;
    for (int x = box.begin.x; x < box.end.x; ++x) {
      if (isBlank({.begin = {x, box.begin.y, box.begin.z}, .end = {x + 1, box.end.y, box.end.z}})) continue;
      runs.push_back({.begin = std::max(box.begin.x, x - more), .end = std::min(box.end.x, x + 1 + more)});
    }
    mergeRuns(runs);
  }

  void readBox(const VoxelBox& box, std::span<std::byte> out) override {
    std::size_t at = 0;
    forEach(box, [&](const std::byte* voxel, std::size_t) {
      std::memcpy(&out[at], voxel, voxelBytes(info_.type));
      at += voxelBytes(info_.type);
      return false;
    });
    if (at != out.size()) throw std::logic_error("a box of another size");
  }

 private:
  bool isBlank(const VoxelBox& box) const {
    const std::size_t bytes = voxelBytes(info_.type);
    return !forEach(box, [&](const std::byte* voxel, std::size_t channel) {
      return std::memcmp(voxel, &info_.blank[channel * bytes], bytes) != 0;
    });
  }

  template <typename Visit>
  bool forEach(const VoxelBox& box, Visit visit) const {
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      for (int z = box.begin.z; z < box.end.z; ++z) {
        for (int y = box.begin.y; y < box.end.y; ++y) {
          for (int x = box.begin.x; x < box.end.x; ++x) {
            if (visit(voxels_->at({x, y, z}, channel), channel)) return true;
          }
        }
      }
    }
    return false;
  }

  std::shared_ptr<MemorySource> voxels_;
  SourceInfo info_;
};

BuildBudget budgetWith(int workers) {
  BuildBudget budget = blockwalk::budgetOf(BuildOptions{}.memory_bytes);
  budget.workers = workers;
  return budget;
}

std::string checkedFile(Source& source, const BuildOptions& options = {}, int workers = 2) {
  const ScratchFolder folder;
  buildVolume(source, folder / "a.bwv", options, budgetWith(workers));
  EXPECT_EQ(verifyVolume(source, folder / "a.bwv"), static_cast<std::uint64_t>(source.info().dims.x) *
                                                        static_cast<std::uint64_t>(source.info().dims.y) *
                                                        static_cast<std::uint64_t>(source.info().dims.z));
  return readBytes(folder / "a.bwv");
}

// Whether it is the file of the voxels that are all yielded, whatever is blank.
void expectTheSame(const std::shared_ptr<MemorySource>& voxels, const std::vector<std::byte>& blank,
                   const BuildOptions& options = {}) {
  BlankSource source(voxels, blank);
  const std::string expected = checkedFile(*voxels, options);
  EXPECT_EQ(checkedFile(source, options, 1), expected);
  EXPECT_EQ(checkedFile(source, options, 3), expected);
}

TEST(BuilderBlank, GivesTheBytesOfASourceThatYieldsIt) {
  for (const VoxelType type : {VoxelType::rgba8, VoxelType::u8, VoxelType::u16, VoxelType::f32}) {
    SCOPED_TRACE(voxelTypeName(type));
    const std::size_t channels = type == VoxelType::u16 ? 3 : 1;
    const auto voxels = std::make_shared<MemorySource>(randomSource(type, {213, 101, 77}, 11, false, channels));
    const std::vector<std::byte> blank(voxelBytes(type) * channels);
    expectTheSame(voxels, blank, {.values = ValuesRule::guess});
    expectTheSame(voxels, blank, {.subblock_side = 4, .block_side = 3, .empty_thresholds = {20}});
    expectTheSame(voxels, blank, {.subblock_side = 16, .values = ValuesRule::guess});
  }
}

// Many labels in long regions: what is guessed must not hang on where the rows are cut.
TEST(BuilderBlank, IsGuessedAlike) {
  const auto voxels = std::make_shared<MemorySource>(VoxelType::u16, glm::ivec3(400, 48, 48));
  for (int z = 0; z < 48; ++z) {
    for (int y = 0; y < 48; ++y) {
      for (int x = 70; x < 390; ++x) {
        voxels->set<std::uint16_t>({x, y, z}, static_cast<std::uint16_t>((x / 7 * 7919 + y / 9 * 104729) % 3000));
      }
    }
  }
  expectTheSame(voxels, std::vector<std::byte>(2), {.values = ValuesRule::guess});
}

// 0 is no empty value where voxels are negative, which only they say.
TEST(BuilderBlank, IsStoredWhereItIsNotEmpty) {
  const auto reals = std::make_shared<MemorySource>(randomSource(VoxelType::f32, {120, 60, 50}, 3, true));
  expectTheSame(reals, std::vector<std::byte>(4));
  expectTheSame(reals, std::vector<std::byte>(4), {.empty_thresholds = {-1}});
  expectTheSame(reals, std::vector<std::byte>(4), {.empty_thresholds = {0}});
  for (const bool negative : {false, true}) {
    auto shifted = std::make_shared<MemorySource>(VoxelType::u8, glm::ivec3(120, 60, 50));
    shifted->change().channels[0].value_offset = -128;
    std::ranges::fill(shifted->voxels, std::byte{128});
    for (int i = 0; i < 200; ++i) {
      shifted->set<std::uint8_t>({20 + i % 9, 7 + i % 23, 9 + i % 31}, static_cast<std::uint8_t>(129 + i % 90));
    }
    if (negative) shifted->set<std::uint8_t>({100, 50, 40}, 3);
    expectTheSame(shifted, {std::byte{128}});
    expectTheSame(shifted, {std::byte{128}}, {.empty_thresholds = {-5}});
    expectTheSame(shifted, {std::byte{128}}, {.empty_thresholds = {5}});
  }
}

TEST(BuilderBlank, IsTheWholeOrNothing) {
  const auto nothing = std::make_shared<MemorySource>(VoxelType::u8, glm::ivec3(100, 70, 60));
  expectTheSame(nothing, std::vector<std::byte>(1));
  const auto all = std::make_shared<MemorySource>(VoxelType::u8, glm::ivec3(100, 70, 60));
  std::ranges::fill(all->voxels, std::byte{9});
  expectTheSame(all, std::vector<std::byte>(1));
}

TEST(BuilderBlank, IsVerifiedWhereSomethingIsStored) {
  const ScratchFolder folder;
  auto voxels = std::make_shared<MemorySource>(VoxelType::u8, glm::ivec3(200, 90, 90));
  voxels->set<std::uint8_t>({150, 60, 70}, 7);
  buildVolume(*voxels, folder / "a.bwv", {});
  const auto refusal = [&](const MemorySource& other) -> std::string {
    BlankSource source(std::make_shared<MemorySource>(other), std::vector<std::byte>(1));
    try {
      verifyVolume(source, folder / "a.bwv");
    } catch (const DataError& error) {
      return error.what();
    }
    return "the same";
  };
  EXPECT_EQ(refusal(*voxels), "the same");
  MemorySource more = *voxels;
  more.set<std::uint8_t>({3, 4, 5}, 1);
  EXPECT_THAT(refusal(more), HasSubstr("voxel 3,4,5 is not stored"));
  EXPECT_THAT(refusal(MemorySource(VoxelType::u8, {200, 90, 90})), HasSubstr("voxel 150,60,70 differs"));
}

// A few balls in all the index space there can be; counts what it is asked.
class Balls final : public Source {
 public:
  struct Asked {
    std::atomic<std::uint64_t> boxes = 0;
    std::atomic<std::uint64_t> voxels = 0;
  };
  explicit Balls(std::shared_ptr<Asked> asked) : asked_(std::move(asked)) {
    info_ = {.name = "balls", .format = "memory", .type = VoxelType::u8, .dims = glm::ivec3(kMaxDim)};
    info_.random_access = true;
    info_.blank = {std::byte{0}};
  }
  const SourceInfo& info() const override { return info_; }
  std::unique_ptr<Source> another() const override { return std::make_unique<Balls>(asked_); }
  void readRows(int, int, int, std::span<std::byte>) override { throw std::logic_error("rows of blank space"); }

  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override {
    ++asked_->boxes;
    runs.clear();
    for (const glm::ivec3& center : kCenters) {
      const glm::ivec3 low = glm::max(center - kRadius, box.begin);
      const glm::ivec3 high = glm::min(center + kRadius + 1, box.end);
      if (glm::all(glm::lessThan(low, high))) runs.push_back({.begin = low.x, .end = high.x});
    }
    mergeRuns(runs);
  }

  void readBox(const VoxelBox& box, std::span<std::byte> out) override {
    asked_->voxels += out.size();
    std::size_t at = 0;
    for (int z = box.begin.z; z < box.end.z; ++z) {
      for (int y = box.begin.y; y < box.end.y; ++y) {
        for (int x = box.begin.x; x < box.end.x; ++x, ++at) {
          const bool inside = std::ranges::any_of(kCenters, [&](glm::ivec3 center) {
            const glm::dvec3 off(glm::ivec3(x, y, z) - center);
            return glm::dot(off, off) <= kRadius * kRadius;
          });
          out[at] = static_cast<std::byte>(inside ? 200 : 0);
        }
      }
    }
  }

  static constexpr int kRadius = 20;
  static constexpr std::array<glm::ivec3, 4> kCenters = {glm::ivec3(40, 50, 60), glm::ivec3(65500, 65501, 65502),
                                                         glm::ivec3(30000, 61000, 22), glm::ivec3(30100, 61000, 22)};

 private:
  std::shared_ptr<Asked> asked_;
  SourceInfo info_;
};

TEST(BuilderBlank, CostsNextToNothing) {
  const ScratchFolder folder;
  const auto asked = std::make_shared<Balls::Asked>();
  Balls source(asked);
  const std::uint64_t before = allocations().bytes;
  forgetMost();
  const BuildReport report = buildVolume(source, folder / "a.bwv", {}, budgetWith(2));
  EXPECT_LT(allocations().most - before, std::uint64_t{256} << 20);
  EXPECT_LT(report.file_bytes, std::uint64_t{4} << 20);
  // A ball lies in 6^3 subblocks and in 2^3 blocks; halving 2^16 voxels goes a dozen times each way.
  EXPECT_LT(asked->voxels, 4u * 6 * 6 * 6 * 512 * 2);
  EXPECT_LT(asked->boxes, 4000u);
  const std::uint64_t ball = 33401;  // points of the lattice no further than 20 from one
  EXPECT_EQ(report.info.channels[0].nonempty_voxels, 4 * ball);
  EXPECT_EQ(verifyVolume(source, folder / "a.bwv"), std::uint64_t{1} << 48);
}

}  // namespace
}  // namespace blockwalk::volume_test
