// SPDX-License-Identifier: Apache-2.0
// Frames in pieces: several under way at once are what they are alone, and one that is cancelled ends with the piece at
// hand, whatever it is at.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk::test {
namespace {

class PiecesTest : public OwnRendererTest {
 protected:
  void SetUp() override {
    for (const VoxelType type : {VoxelType::u8, VoxelType::rgba8}) {
      files_.push_back(buildFile(*makeSynthetic({.type = type, .dims = {110, 96, 90}, .seed = 3})));
    }
    renderer_ = start();
  }
  void TearDown() override {
    volumes_.clear();
    OwnRendererTest::TearDown();
  }

  // With bands of few rows.
  std::unique_ptr<Renderer> start(DeviceOptions options = {}) {
    options.band_ms = 0.3;
    std::unique_ptr<Renderer> made = create(options);
    volumes_.clear();
    for (const auto& file : files_) volumes_.push_back(made->load(VolumeFile(file)));
    return made;
  }

  struct Asked {
    std::size_t volume = 0;
    FrameOrder order{};
  };
  // Views that need different parts, and some that share them.
  std::vector<Asked> everything() {
    std::vector<Asked> asked;
    const auto add = [&](std::size_t volume, View view, auto... change) {
      view.width = 120;
      view.height = 90;
      (change(view), ...);
      asked.push_back({.volume = volume, .order = {.view = resolveView(view, volumes_[volume]->info())}});
    };
    const auto range = [](double lo) { return [lo](View& v) { v.channels[0].range = DensityRange{lo, 220}; }; };
    add(0, {}, range(40));
    add(0, {}, range(90), [](View& v) { v.filter = Filter::linear; });
    add(1, {}, [](View& v) { v.samples = 4; });
    add(0, {}, range(60), [](View& v) { v.finder = Finder::octree; });
    add(1, {}, range(100), [](View& v) { v.lit = true; });
    add(0, {}, [](View& v) { v.output = Output::depth, v.mode = Mode::first_hit; });
    add(0, {}, [](View& v) { v.channels[0].transfer_preset = TransferPreset::inferno; });
    if (renderer_->device().ray_query) {
      for (const double lo : {50.0, 120.0}) {
        add(0, {}, range(lo), [](View& v) { v.finder = Finder::boundary; });
        add(1, {}, range(lo), [](View& v) { v.finder = Finder::clusters; });
      }
      add(1, {}, [](View& v) { v.finder = Finder::query; });
    }
    for (int owner : {1, 2}) {
      add(1, {}, [&](View& v) { v.samples = 6, v.fov_degrees = 30 + 5 * owner; });
      asked.back().order.step = SampleStep{.owner = static_cast<std::uint64_t>(owner), .begin = 0, .end = 3};
    }
    return asked;
  }

  std::vector<std::filesystem::path> files_;
  std::vector<std::unique_ptr<ResidentVolume>> volumes_;
};

TEST_F(PiecesTest, FramesThatTakeTurnsAreWhatTheyAreAlone) {
  std::vector<Frame> alone;
  for (const Asked& asked : everything()) alone.push_back(renderer_->render(*volumes_[asked.volume], asked.order));

  volumes_.clear();
  renderer_ = start();
  const std::vector<Asked> all = everything();
  std::vector<std::unique_ptr<FrameInProgress>> frames;
  for (const Asked& asked : all) frames.push_back(renderer_->begin(*volumes_[asked.volume], asked.order));
  std::vector<bool> more(frames.size(), true);
  std::size_t turns = 0;
  while (std::ranges::find(more, true) != more.end()) {
    ++turns;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (more[i]) more[i] = frames[i]->advance();
    }
  }
  EXPECT_GT(turns, 5u);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame frame = frames[i]->finish();
    EXPECT_FALSE(frame.cancelled);
    EXPECT_EQ(frame.pixels, alone[i].pixels) << i;
    EXPECT_EQ(frame.values, alone[i].values) << i;
    EXPECT_EQ(frame.stats.voxel_steps, alone[i].stats.voxel_steps) << i;
    EXPECT_EQ(frame.stats.block_visits, alone[i].stats.block_visits) << i;
    EXPECT_EQ(frame.stats.kernel, alone[i].stats.kernel);
  }
}

// Macrocells are looked at a layer of workgroups at a time: many submissions, and the same boxes, faces and pictures.
TEST_F(PiecesTest, RegionsMadeOfManySlabsAreTheSame) {
  if (!renderer_->device().ray_query) GTEST_SKIP() << "this device has no ray queries";
  struct Made {
    Frame frame;
    int submissions = 0;  // until all is resident
  };
  const auto make = [&](Finder finder, DeviceOptions options) {
    Made made;
    options.inject_fault = [&made](DeviceCall call) {
      made.submissions += call == DeviceCall::submit ? 1 : 0;
      return DeviceFault::none;
    };
    renderer_ = start(options);
    View view;
    view.width = view.height = 60;
    view.level = 0;
    view.finder = finder;
    view.channels[0].range = DensityRange{60, 200};
    const ResolvedView resolved = resolveView(view, volumes_[0]->info());
    made.submissions = 0;
    renderer_->render(*volumes_[0], {.view = resolved, .prepare_only = true});
    const int until_resident = made.submissions;
    made.frame = renderer_->render(*volumes_[0], {.view = resolved});
    made.submissions = until_resident;
    volumes_.clear();
    renderer_.reset();
    return made;
  };
  DeviceOptions in_layers;
  in_layers.piece_macrocells = 1;
  for (const Finder finder : {Finder::clusters, Finder::boundary}) {
    const Made whole = make(finder, {});
    const Made cut = make(finder, in_layers);
    const FinderBuild& expected = whole.frame.stats.finder_build;
    EXPECT_EQ(cut.frame.pixels, whole.frame.pixels);
    EXPECT_GT(expected.active_macrocells, 0u);
    EXPECT_EQ(cut.frame.stats.finder_build.active_macrocells, expected.active_macrocells);
    EXPECT_EQ(cut.frame.stats.finder_build.primitives, expected.primitives);
    // 12 macrocells along z are 3 layers: 2 more submissions a kernel, of which clusters have 3, the boundary 6; and
    // faces across z have a layer more.
    EXPECT_EQ(cut.submissions - whole.submissions, finder == Finder::boundary ? 13 : 6);
  }
}

// However many pieces there are: stopped after each of them in turn, on a renderer that goes on where the last one was.
TEST_F(PiecesTest, ACancelledFrameEndsWithThePieceAtHand) {
  View view;
  view.width = 120;
  view.height = 90;
  view.filter = Filter::linear;
  view.finder = renderer_->device().ray_query ? Finder::clusters : Finder::octree;
  view.channels[0].range = DensityRange{60, 200};
  const FrameOrder order{.view = resolveView(view, volumes_[0]->info())};
  const Frame whole = renderer_->render(*volumes_[0], order);

  volumes_.clear();
  renderer_ = start();
  int stopped = 0;
  for (bool finished = false; !finished; ++stopped) {
    ASSERT_LT(stopped, 10'000);
    FrameOrder stoppable = order;
    stoppable.cancel = std::make_shared<std::atomic<bool>>(false);
    const std::unique_ptr<FrameInProgress> frame = renderer_->begin(*volumes_[0], stoppable);
    finished = !frame->advance();
    for (int i = 0; !finished && i < stopped % 7; ++i) finished = !frame->advance();
    if (finished) {
      EXPECT_EQ(frame->finish().pixels, whole.pixels);
      break;
    }
    *stoppable.cancel = true;
    EXPECT_FALSE(frame->advance());
    EXPECT_TRUE(frame->finish().cancelled);
    if (stopped > 40) {
      EXPECT_EQ(renderer_->render(*volumes_[0], order).pixels, whole.pixels);
      break;
    }
  }
  EXPECT_GT(stopped, 5);
}

TEST_F(PiecesTest, WhatACancelledFrameBeganGoesOn) {
  View view;
  view.filter = Filter::linear;
  const FrameOrder order{.view = resolveView(view, volumes_[0]->info()), .prepare_only = true};
  int pieces = 0;
  for (bool more = true; more; ++pieces) {  // a new frame for every piece
    ASSERT_LT(pieces, 1000);
    more = renderer_->begin(*volumes_[0], order)->advance();
  }
  EXPECT_GT(pieces, 3);
  const auto parts = volumes_[0]->parts();
  EXPECT_NE(std::ranges::find(parts, "voxels", &ResidentPart::what), parts.end());
}

// What is as large as the volume is never one piece: whoever waits for the device is let in between.
TEST_F(PiecesTest, LargePartsAreMadeInMany) {
  const auto source = makeSynthetic({.type = VoxelType::rgba8, .dims = {130, 120, 110}, .seed = 6});
  const std::filesystem::path file = buildFile(*source, {.subblock_side = 4, .block_side = 1});
  const auto volume = renderer_->load(VolumeFile(file));
  View view;
  view.level = 0;
  view.filter = Filter::linear;
  view.finder = Finder::grid;
  view.channels[0].range = DensityRange{60, 200};
  const auto frame = renderer_->begin(*volume, {.view = resolveView(view, volume->info()), .prepare_only = true});
  std::map<std::string, std::uint64_t> pieces;
  std::map<std::string, std::uint64_t> made;
  for (bool more = true; more;) {
    more = frame->advance();
    for (const PartTotal& total : renderer_->parts()) {
      // What is in the making has its memory from the first piece on.
      if (total.bytes > 0 && made[total.what] == 0) ++pieces[total.what];
      made[total.what] = total.made;
    }
  }
  const std::size_t blocks = VolumeFile(file).readApronLevel(0, 0).blocks.size();
  ASSERT_GT(blocks, 4u * 1024);
  EXPECT_EQ(pieces["quarters"], (blocks + 1023) / 1024);
  EXPECT_GT(pieces["voxels"], volume->info().levels[0].voxel_bytes >> 20);  // 2 MiB each, with an apron
}

// Half of what a frame began, and whole parts that nobody uses, go with their volume.
TEST_F(PiecesTest, AVolumeLeavesNothing) {
  const std::uint64_t before = renderer_->device().memory_used_bytes;
  View view;
  view.channels[0].range = DensityRange{60, 200};
  {
    const std::unique_ptr<FrameInProgress> frame =
        renderer_->begin(*volumes_[0], {.view = resolveView(view, volumes_[0]->info())});
    for (int i = 0; i < 3; ++i) frame->advance();
  }
  EXPECT_GT(renderer_->device().memory_used_bytes, before);
  volumes_[0].reset();
  EXPECT_EQ(renderer_->device().memory_used_bytes, before);
}

TEST_F(PiecesTest, LoadingReadsNothing) {
  for (const auto& volume : volumes_) {
    EXPECT_EQ(volume->deviceBytes(), 0u);
    EXPECT_TRUE(volume->parts().empty());
  }
}

}  // namespace
}  // namespace blockwalk::test
