// SPDX-License-Identifier: Apache-2.0
#include "renderer/finder_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "renderer/plan/plan.h"
#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk::test {
namespace {

constexpr Finder kQueryOrGrid[] = {Finder::query, Finder::grid};

Finder measureAll(FinderTrial trial, const std::function<double(Finder)>& measure) {
  while (const std::optional<Finder> next = trial.next()) trial.took(measure(*next));
  return trial.fastest();
}

TEST(FinderTrial, HasTheLeastTimeOfAnyRoundButTheFirst) {
  // The first time of each compiles.
  std::map<Finder, std::vector<double>> times{{Finder::query, {1, 9, 7, 8}}, {Finder::grid, {99, 20, 20, 6}}};
  std::map<Finder, std::size_t> asked;
  const Finder fastest =
      measureAll(FinderTrial(kQueryOrGrid, 3), [&](Finder finder) { return times[finder].at(asked[finder]++); });
  EXPECT_EQ(fastest, Finder::grid);
  EXPECT_EQ(asked[Finder::query], 4u);
  EXPECT_EQ(asked[Finder::grid], 4u);
}

TEST(FinderTrial, IsTheFirstOfEquals) {
  EXPECT_EQ(measureAll(FinderTrial(kQueryOrGrid, 2), [](Finder) { return 3.0; }), Finder::query);
}

TEST(FinderChoices, AreTriedByOneFrameAtATimeAndOnce) {
  FinderChoices choices;
  EXPECT_TRUE(choices.beginTrial(7));
  EXPECT_FALSE(choices.beginTrial(7));
  EXPECT_TRUE(choices.beginTrial(8));
  choices.abandonTrial(7);
  EXPECT_TRUE(choices.beginTrial(7));
  choices.settle(7, Finder::query);
  EXPECT_FALSE(choices.beginTrial(7));
  EXPECT_EQ(choices.find(7), Finder::query);
  EXPECT_EQ(choices.find(8), Finder::automatic);
  choices.forget(7);
  EXPECT_EQ(choices.find(7), Finder::automatic);
}

class FinderChoiceTest : public RendererTest {};

bool holds(const ResidentVolume& volume, std::string_view what) {
  const auto parts = volume.parts();
  return std::ranges::any_of(parts, [&](const ResidentPart& part) { return part.what == what; });
}

TEST_F(FinderChoiceTest, MeasuresOnceAndKeepsWhatItChose) {
  if (!renderer().device().ray_query) GTEST_SKIP() << "this device has no ray queries";
  DeviceOptions options;
  options.probe_software = true;
  const std::unique_ptr<Renderer> other = createRenderer(options);
  const auto source = makeSynthetic({.type = VoxelType::rgba8, .dims = {100, 70, 60}});
  const std::unique_ptr<ResidentVolume> volume = other->load(VolumeFile(buildFile(*source, {})));
  View view;
  view.width = 90;
  view.height = 70;
  view.finder = Finder::grid;
  const Frame expected = draw(*other, *volume, view);
  EXPECT_FALSE(holds(*volume, "instances")) << "a view that names its finder needs no probe";

  view.finder = Finder::automatic;
  const Frame first = draw(*other, *volume, view);
  EXPECT_LE(compareImages(first, expected).largest, 1);
  ASSERT_TRUE(first.stats.finder == "grid" || first.stats.finder == "query") << first.stats.finder;
  const bool grid = first.stats.finder == "grid";
  EXPECT_EQ(holds(*volume, "grid"), grid);
  EXPECT_EQ(holds(*volume, "instances"), !grid);

  // Nothing is built or tried again, whatever the view.
  view.eye = glm::dvec3(300, 20, 10);
  EXPECT_EQ(draw(*other, *volume, view).stats.finder, first.stats.finder);
  EXPECT_EQ(holds(*volume, grid ? "instances" : "grid"), false);
}

}  // namespace
}  // namespace blockwalk::test
