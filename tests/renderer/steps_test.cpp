// SPDX-License-Identifier: Apache-2.0
// Steps in time: each is drawn as a volume of its own would be, in the colours of all.
#include <gtest/gtest.h>

#include <array>

#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"
#include "volume/build/steps_builder.h"

namespace blockwalk::test {
namespace {

constexpr int kSteps = 3;

class StepsTest : public RendererTest {
 protected:
  static SyntheticOptions optionsOf(int step) {
    return {.type = VoxelType::u16, .dims = {60, 50, 40}, .seed = static_cast<unsigned>(20 + step)};
  }
  // A file of all, and one of each.
  static void SetUpTestSuite() {
    together_ = buildFile(*makeSynthetic(optionsOf(0)));  // for its name
    StepsBuilder builder(together_, kSteps);
    for (int step = 0; step < kSteps; ++step) {
      const auto source = makeSynthetic(optionsOf(step));
      builder.add(*source, {});
      alone_[static_cast<std::size_t>(step)] = buildFile(*source);
    }
    builder.finish();
  }

  // Everything said, so that nothing is chosen for one volume alone.
  static View viewOf(const VolumeInfo& info, Mode mode) {
    View view;
    view.width = 96;
    view.height = 80;
    view.mode = mode;
    view.filter = Filter::linear;
    view.level = 0;
    return spellOut(resolveView(view, info));
  }

  static std::filesystem::path together_;
  static std::array<std::filesystem::path, kSteps> alone_;
};

std::filesystem::path StepsTest::together_;
std::array<std::filesystem::path, kSteps> StepsTest::alone_;

TEST_F(StepsTest, AreDrawnAsVolumesOfTheirOwn) {
  const std::unique_ptr<ResidentVolume> volume = renderer().load(VolumeFile(together_));
  ASSERT_EQ(volume->info().steps, kSteps);
  for (const Mode mode : {Mode::blend, Mode::mip, Mode::iso}) {
    std::vector<Frame> frames;
    for (int step = kSteps - 1; step >= 0; --step) {
      View view = viewOf(volume->info(), mode);
      const std::unique_ptr<ResidentVolume> alone = renderer().load(VolumeFile(alone_[static_cast<std::size_t>(step)]));
      const Frame expected = draw(renderer(), *alone, view);
      view.time = step;
      frames.push_back(draw(renderer(), *volume, view));
      // Tables of colours cover what all steps hold: a colour may differ by their rounding.
      const ImageError error = compareImages(frames.back(), expected);
      EXPECT_LE(error.largest, kLargestError) << step << ": " << error.worst;
    }
    EXPECT_NE(frames[0].pixels, frames[1].pixels);
    EXPECT_NE(frames[1].pixels, frames[2].pixels);
  }
}

TEST_F(StepsTest, ShareTheirColours) {
  const VolumeFile file(together_);
  const View chosen = spellOut(resolveView({}, file.info()));
  for (int step = 0; step < kSteps; ++step) {
    View own = spellOut(resolveView({}, file.atStep(step).info()));
    EXPECT_EQ(own, chosen) << step;
  }
}

// A step and its kept sums are its own: what is refined goes on where another step was drawn meanwhile.
TEST_F(StepsTest, RefineEachByItself) {
  const std::unique_ptr<ResidentVolume> volume = renderer().load(VolumeFile(together_));
  View view = viewOf(volume->info(), Mode::blend);
  view.samples = 4;
  view.time = 1;
  const Frame whole = draw(renderer(), *volume, view);
  for (const int end : {2, 4}) {
    const int begin = end == 2 ? 0 : 2;
    const Frame step = renderer().render(*volume, view, {.step = SampleStep{.owner = 9, .begin = begin, .end = end}});
    if (end == 4) {
      EXPECT_EQ(step.pixels, whole.pixels);
    }
    View other = view;
    other.time = 2;
    other.samples = 1;
    draw(renderer(), *volume, other);
  }
  renderer().forget(9);
}

TEST_F(StepsTest, OneThatIsNotThereIsRefused) {
  const std::unique_ptr<ResidentVolume> volume = renderer().load(VolumeFile(together_));
  for (const int time : {-1, kSteps}) {
    View view;
    view.time = time;
    try {
      resolveView(view, volume->info());
      FAIL();
    } catch (const ViewError& error) {
      EXPECT_EQ(error.field, "time");
    }
  }
}

}  // namespace
}  // namespace blockwalk::test
