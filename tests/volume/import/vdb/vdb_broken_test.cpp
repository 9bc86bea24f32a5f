// SPDX-License-Identifier: Apache-2.0
// VDB files that are broken, or as large as an index space can be.
#include <gtest/gtest.h>

#ifdef BLOCKWALK_OPENVDB
#include <atomic>
#include <memory>
#include <random>

#include "tests/volume/import/broken.h"
#include "tests/volume/import/vdb/vdb_files.h"
#include "volume/build/builder.h"

namespace blockwalk::volume_test {
namespace {

class VdbBroken : public VdbTest {};

// Cut off in the header of a grid, where those before it are whole.
TEST_F(VdbBroken, ACutFileIsNotItsFirstGrids) {
  auto color = named<openvdb::Vec3SGrid>("albedo", openvdb::Vec3s(0));
  color->getAccessor().setValue(Coord(1, 2, 3), openvdb::Vec3s(1, 0, 0));
  const std::string whole = bytesIn(save({color, someFloats()}));
  const std::size_t header = whole.find("density");
  ASSERT_NE(header, std::string::npos);
  for (std::size_t size = header - 24; size < header + 500; size += 13) {
    const auto path = scratch_.write("cut.vdb", whole.substr(0, size));
    EXPECT_THROW((void)openSource({path}, {}), DataError) << size;
  }
}

TEST_F(VdbBroken, SurvivesBreaking) {
  auto color = named<openvdb::Vec3SGrid>("albedo", openvdb::Vec3s(0));
  color->getAccessor().setValue(Coord(1, 2, 3), openvdb::Vec3s(1, 0, 0));
  auto grid = someFloats();
  grid->pruneGrid();
  survivesBreakingInBounds(scratch_, "b.vdb", bytesIn(save({color, grid})));
}

// Passes everything on, and counts the voxels that are looked at.
class CountingSource final : public Source {
 public:
  using Count = std::shared_ptr<std::atomic<std::uint64_t>>;
  CountingSource(std::unique_ptr<Source> source, Count count) : source_(std::move(source)), count_(std::move(count)) {}
  const SourceInfo& info() const override { return source_->info(); }
  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    *count_ += static_cast<std::uint64_t>(count) * static_cast<std::uint64_t>(info().dims.x);
    source_->readRows(z, y, count, out);
  }
  std::unique_ptr<Source> another() const override {
    return std::make_unique<CountingSource>(source_->another(), count_);
  }
  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override { source_->findRuns(box, runs); }
  void readBox(const VoxelBox& box, std::span<std::byte> out) override {
    *count_ += cellCount(box.dims());
    source_->readBox(box, out);
  }
  ConversionReport conversion(std::size_t channel) const override { return source_->conversion(channel); }

 private:
  std::unique_ptr<Source> source_;
  Count count_;
};

TEST_F(VdbBroken, WhatIsActiveIsLookedAtAlone) {
  auto grid = named<openvdb::FloatGrid>("density", 0);
  auto access = grid->getAccessor();
  std::mt19937 random(5);
  const auto place = [&] { return static_cast<int>(random() % 20000); };
  for (int i = 0; i < 4000; ++i) {
    const Coord corner(place(), place(), place());
    for (int j = 0; j < 8; ++j)
      access.setValue(corner.offsetBy(j & 1, j >> 1 & 1, j >> 2), 1.0f + static_cast<float>(i));
  }
  const auto path = save({grid});
  const auto looked_at = std::make_shared<std::atomic<std::uint64_t>>(0);
  CountingSource source(openSource({path}, {}), looked_at);
  EXPECT_GT(source.info().dims.x, 19900);
  const BuildReport report = buildVolume(source, scratch_.path("a.bwv"), {});
  EXPECT_EQ(report.info.channels[0].nonempty_voxels, grid->activeVoxelCount());
  // Of 8 10^12: each of 4000 groups lies in one to eight subblocks of 8^3, and is read twice at most.
  EXPECT_GE(*looked_at, 4000u * 8);
  EXPECT_LE(*looked_at, 2u * 4000 * 8 * 512);
}

}  // namespace
}  // namespace blockwalk::volume_test

#endif
