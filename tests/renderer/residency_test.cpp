// SPDX-License-Identifier: Apache-2.0
// The table of what is resident: what is made once, what gives way, and what does not.
#include "renderer/resident/residency.h"
#include "view/device_info.h"

#include <gtest/gtest.h>

#include <map>

namespace blockwalk {
namespace {

struct FakePart final : Resident {
  explicit FakePart(std::uint64_t bytes) : size(bytes) {}
  std::uint64_t bytes() const override { return size; }
  std::uint64_t size;
  std::shared_ptr<const FakePart> made_of;
};

class FakeMaking final : public Making {
 public:
  FakeMaking(int pieces, std::unique_ptr<FakePart> made) : pieces_(pieces), made_(std::move(made)) {}
  std::unique_ptr<Resident> advance() override {
    if (--pieces_ > 0) return nullptr;
    if (made_ == nullptr) throw DeviceError("told to fail");
    return std::move(made_);
  }
  std::uint64_t bytes() const override { return made_ ? made_->bytes() : 0; }

 private:
  int pieces_;
  std::unique_ptr<FakePart> made_;
};

class ResidencyTest : public ::testing::Test {
 protected:
  static Need voxels(int level) { return {.part = Part::voxels, .level = level, .channel = 0}; }
  static Need quarters(float lo) { return {.part = Part::visible_quarters, .channel = 0, .range = {lo, 9}}; }

  std::shared_ptr<const Slot> make(const Need& need, std::uint64_t volume = 1, const Pins& inputs = {}) {
    std::shared_ptr<const Slot> slot;
    do {
      slot = residency_.advance({.serial = volume, .file = nullptr}, need, inputs);
    } while (slot->resident == nullptr);
    return slot;
  }
  bool holds(const Need& need, std::uint64_t volume = 1) { return residency_.find(volume, need) != nullptr; }

  int begun_ = 0;
  int pieces_ = 3;
  bool fails_ = false;
  Residency residency_{[this](const StoredVolume&, const Need& need, const Pins& inputs) -> std::unique_ptr<Making> {
    ++begun_;
    auto made = fails_ ? nullptr : std::make_unique<FakePart>(100);
    if (need.part == Part::blocks) {
      made->size = 1;
      made->made_of = inputs.share<FakePart>(voxels(need.level));
    }
    return std::make_unique<FakeMaking>(pieces_, std::move(made));
  }};
};

TEST_F(ResidencyTest, APartIsMadeOnceForAllWhoNeedIt) {
  const auto first = make(voxels(0));
  EXPECT_EQ(make(voxels(0)), first);
  EXPECT_EQ(begun_, 1);
  make(voxels(0), 2);
  make(voxels(1));
  EXPECT_EQ(begun_, 3);
}

TEST_F(ResidencyTest, WorkGoesOnWhereSomeoneElseLeftIt) {
  const StoredVolume volume{.serial = 1, .file = nullptr};
  EXPECT_EQ(residency_.advance(volume, voxels(0), {})->resident, nullptr);
  EXPECT_FALSE(holds(voxels(0)));
  EXPECT_EQ(residency_.advance(volume, voxels(0), {})->resident, nullptr);
  EXPECT_NE(residency_.advance(volume, voxels(0), {})->resident, nullptr);
  EXPECT_EQ(begun_, 1);
}

TEST_F(ResidencyTest, WhatWasUsedLongestAgoGivesWayFirst) {
  for (int level = 0; level < 4; ++level) make(voxels(level));
  EXPECT_TRUE(holds(voxels(0)));  // uses it
  EXPECT_EQ(residency_.evict(150), 200u);
  EXPECT_FALSE(holds(voxels(1)));
  EXPECT_FALSE(holds(voxels(2)));
  EXPECT_TRUE(holds(voxels(0)));
  EXPECT_TRUE(holds(voxels(3)));
}

TEST_F(ResidencyTest, WhatIsSharedNeverGivesWay) {
  const auto shared = make(voxels(0));
  make(voxels(1));
  EXPECT_EQ(residency_.evict(1000), 100u);
  EXPECT_TRUE(holds(voxels(0)));
  EXPECT_FALSE(holds(voxels(1)));
}

TEST_F(ResidencyTest, WhatSomeoneWaitsForDoesNotGiveWay) {
  const StoredVolume volume{.serial = 1, .file = nullptr};
  auto waits = residency_.advance(volume, voxels(0), {});
  EXPECT_EQ(residency_.evict(1000), 0u);
  waits.reset();
  EXPECT_EQ(residency_.evict(1000), 100u) << "nobody waits for it any more";
}

TEST_F(ResidencyTest, APartStaysAsLongAsWhatHoldsItsAddress) {
  Pins inputs;
  inputs.add(voxels(0), make(voxels(0)));
  const Need blocks{.part = Part::blocks, .level = 0, .channel = 0};
  auto kept = make(blocks, 1, inputs);
  inputs.clear();
  EXPECT_EQ(residency_.evict(1000), 0u);
  kept.reset();
  EXPECT_EQ(residency_.evict(1000), 101u) << "first the records, then what they point to";
  EXPECT_FALSE(holds(voxels(0)));
}

TEST_F(ResidencyTest, WhatFailedIsTriedAnew) {
  fails_ = true;
  EXPECT_THROW(make(voxels(0)), DeviceError);
  fails_ = false;
  EXPECT_NE(make(voxels(0)), nullptr);
  EXPECT_EQ(begun_, 2);
}

TEST_F(ResidencyTest, AVolumeTakesItsPartsWithIt) {
  make(voxels(0), 1);
  make(voxels(0), 2);
  residency_.drop(1);
  EXPECT_FALSE(holds(voxels(0), 1));
  EXPECT_TRUE(holds(voxels(0), 2));
}

// Whoever drags a slider makes a range a frame.
TEST_F(ResidencyTest, OfRangesAVolumeKeepsTheLastOnes) {
  for (int i = 0; i < 100; ++i) make(quarters(static_cast<float>(i)));
  int kept = 0;
  for (int i = 0; i < 100; ++i) kept += holds(quarters(static_cast<float>(i))) ? 1 : 0;
  EXPECT_EQ(kept, 16);
  EXPECT_TRUE(holds(quarters(99)));
  EXPECT_TRUE(holds(quarters(84)));
}

TEST_F(ResidencyTest, ReportsWhatItHolds) {
  make(voxels(2));
  make(voxels(3));
  make(quarters(1), 7);
  EXPECT_EQ(residency_.parts(1).size(), 2u);
  EXPECT_EQ(residency_.parts(7).at(0).what, "quarters");
  std::map<std::string, PartTotal> totals;
  for (const PartTotal& total : residency_.totals()) totals[total.what] = total;
  EXPECT_EQ(totals.size(), static_cast<std::size_t>(kPartKinds));
  EXPECT_EQ(totals["voxels"].count, 2u);
  EXPECT_EQ(totals["voxels"].bytes, 200u);
  EXPECT_EQ(totals["quarters"].made, 1u);
  residency_.evict(1000);
  for (const PartTotal& total : residency_.totals()) EXPECT_EQ(total.bytes, 0u);
}

}  // namespace
}  // namespace blockwalk
