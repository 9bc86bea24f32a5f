// SPDX-License-Identifier: Apache-2.0
// The kernel that makes every choice at run time draws what the specialised ones draw, and a volume keeps on the device
// only what its views have asked for.
#include <gtest/gtest.h>

#include <set>

#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk::test {
namespace {

View baseView() {
  View view;
  view.width = 72;
  view.height = 56;
  view.level = 0;
  return view;
}

std::vector<View> looksOfScalars() {
  std::vector<View> looks(11, baseView());
  looks[1].mode = Mode::first_hit;
  looks[1].lit = true;
  looks[2].filter = Filter::linear;
  looks[2].lit = true;
  looks[3].filter = Filter::linear;
  looks[3].classification = Classification::pre_integrated;
  looks[4].mode = Mode::mip;
  looks[5].mode = Mode::iso;
  looks[5].filter = Filter::linear;
  looks[6].samples = 3;
  looks[6].background = {10, 20, 30, 128};
  looks[7].mode = Mode::mean;
  looks[7].planes.push_back({.normal = {1, 1, 0.5}, .offset = -40});
  looks[8].mode = Mode::minip;
  looks[9].mode = Mode::minip;
  looks[9].filter = Filter::linear;
  looks[10].mode = Mode::attenuated_mip;
  looks[10].filter = Filter::linear;
  return looks;
}

std::set<std::string> residentParts(const Scene& scene) {
  std::set<std::string> parts;
  for (const ResidentPart& part : scene.resident->parts()) {
    EXPECT_GT(part.bytes, 0u) << part.what;
    parts.insert(part.what + " " + std::to_string(part.level) + (part.apron ? " with apron" : ""));
  }
  return parts;
}

class GeneralKernelTest : public RendererTest {
 protected:
  static void expectSame(Scene& scene, const View& view) {
    const Frame special = draw(scene, view);
    const Frame general = renderer().render(*scene.resident, view, {.probe = true, .general = true});
    EXPECT_EQ(general.stats.kernel, "general " + special.stats.kernel);
    EXPECT_EQ(general.stats.voxel_steps, special.stats.voxel_steps) << toString(view);
    EXPECT_EQ(general.stats.loop_bound_hits, 0u);
    const ImageError error = compareImages(special, general);
    EXPECT_EQ(error.largest, 0) << toString(view) << ": " << error.worst;
    EXPECT_GT(std::set(special.pixels.begin(), special.pixels.end()).size(), 30u) << toString(view);
  }
};

TEST_F(GeneralKernelTest, DrawsScalarsAsTheSpecialisedOnes) {
  const auto source = makeSynthetic({.type = VoxelType::u16, .dims = glm::ivec3(56)});
  Scene scene = makeScene(*source);
  for (const View& view : looksOfScalars()) expectSame(scene, view);
}

TEST_F(GeneralKernelTest, DrawsColourAsTheSpecialisedOnes) {
  const auto source = makeSynthetic({.type = VoxelType::rgba8, .dims = glm::ivec3(56)});
  Scene scene = makeScene(*source);
  View half = baseView();
  half.channels[0].range = DensityRange{.lo = 128, .hi = 255};
  expectSame(scene, half);
  for (Finder finder : {Finder::query, Finder::clusters, Finder::boundary, Finder::octree, Finder::none}) {
    const bool asks_rays = finder != Finder::octree && finder != Finder::none;
    half.finder = finder;
    if (!asks_rays || renderer().device().ray_query) expectSame(scene, half);
  }
  View smooth = baseView();
  smooth.filter = Filter::linear;
  expectSame(scene, smooth);
}

TEST_F(GeneralKernelTest, DrawsChannelsAsTheSpecialisedOnes) {
  const auto source = makeSynthetic({.type = VoxelType::u16, .dims = glm::ivec3(56), .channels = 3});
  Scene scene = makeScene(*source);
  const std::vector<View> looks = looksOfScalars();
  for (const std::size_t i : {0, 1, 2, 3, 4}) expectSame(scene, looks[i]);
  View one = looks[0];
  one.drawn = {1};
  expectSame(scene, one);
}

TEST_F(GeneralKernelTest, LeavesOutWhatNoViewHasAskedFor) {
  const auto source = makeSynthetic({.type = VoxelType::u8, .dims = glm::ivec3(120)});
  Scene scene = makeScene(*source);
  View view = baseView();
  view.finder = Finder::grid;
  view.level = 1;
  const std::set<std::string> loaded = residentParts(scene);
  EXPECT_FALSE(loaded.contains("voxels 1"));

  auto addedBy = [&, seen = loaded](const View& asked) mutable {
    draw(scene, asked);
    std::set<std::string> added;
    for (const std::string& part : residentParts(scene)) {
      if (seen.insert(part).second) added.insert(part);
    }
    return added;
  };
  const std::set<std::string> drawn = {"voxels 1", "blocks 1", "grid 1", "table 0"};
  View open = view;
  open.cull = false;
  open.channels[0].transfer = {{.value = 0, .opacity = 0.5}, {.value = 255, .opacity = 0.5}};
  EXPECT_EQ(addedBy(open), drawn);
  View cut = open;
  cut.cull = true;
  cut.channels[0].range = DensityRange{.lo = 100, .hi = 200};
  EXPECT_EQ(addedBy(cut), (std::set<std::string>{"masks 1", "quarters 1"}));
  View smooth = open;
  smooth.filter = Filter::linear;
  EXPECT_EQ(addedBy(smooth),
            (std::set<std::string>{"voxels 1 with apron", "blocks 1 with apron", "grid 1 with apron"}));
  EXPECT_EQ(addedBy(cut), (std::set<std::string>{}));
}

}  // namespace
}  // namespace blockwalk::test
