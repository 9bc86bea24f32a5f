// SPDX-License-Identifier: Apache-2.0
// Cameras where rounding is worst: eyes on corners, rays along axes and in planes of faces, eyes a million voxels away.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk::test {
namespace {

constexpr double kLeastPsnr = 55;

struct NamedView {
  std::string name;
  View view;
};

class ExtremesTest : public RendererTest {
 protected:
  // A view whose eye and target are given in index space.
  static View indexView(const VolumeInfo& info, glm::dvec3 eye, glm::dvec3 target, glm::dvec3 up) {
    const auto world = [&](glm::dvec3 p) { return glm::dvec3(info.world_from_index * glm::dvec4(p, 1)); };
    View view;
    view.width = 65;  // odd, so that a ray looks straight ahead
    view.height = 49;
    view.level = 0;
    view.eye = world(eye);
    view.target = world(target);
    view.up = glm::dvec3(info.world_from_index * glm::dvec4(up, 0));
    view.fov_degrees = 60;
    return view;
  }

  static std::vector<NamedView> views(const VolumeInfo& info) {
    const glm::dvec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    std::vector<NamedView> list{
        {"eye on a voxel corner", indexView(info, {31, 29, 27}, {50, 40, 33}, y)},
        {"eye on a block corner", indexView(info, {48, 48, 48}, {0, 3, 9}, y)},
        {"eye on a block corner, along x", indexView(info, {48, 48, 48}, {0, 48, 48}, y)},
        {"eye on the volume's corner", indexView(info, {0, 0, 0}, glm::dvec3(info.dims), y)},
        {"eye on a voxel face, along it", indexView(info, {31.5, 20, 27.5}, {31.5, 20, 10}, y)},
        {"along the diagonal", indexView(info, {-30, -30, -30}, {30, 30, 30}, y)},
    };
    // Orthographic, one pixel a voxel: rays on every face plane, then through every voxel's centre.
    for (const auto& [name, shift] : {std::pair{"ortho on faces", 0.5}, {"ortho on centres", 0.0}}) {
      for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 center(32.5 + shift);
        glm::dvec3 eye = center;
        eye[axis] = axis == 1 ? -50 : 150;
        View view = indexView(info, eye, center, axis == 2 ? x : z);
        const glm::dvec3 up(info.world_from_index[axis == 2 ? 0 : 2]);
        view.ortho_height = view.height * glm::length(up);
        list.push_back({fmt::format("{} along axis {}", name, axis), view});
      }
    }
    return list;
  }

  static void expectTruth(Scene& scene, const reference::DenseVolume& dense, const NamedView& named) {
    View view = spellOut(resolveView(named.view, scene.info));
    const reference::Image expected = reference::renderImage(dense, view);
    View hit_view = view;
    hit_view.mode = Mode::first_hit;
    const reference::Image hits = reference::renderImage(dense, hit_view);
    View blocks_view = view;
    blocks_view.mode = Mode::blocks;
    const reference::Image blocks = reference::renderImage(dense, blocks_view);
    for (const Combination& combination : combinations()) {
      const std::string what = named.name + ", " + toString(combination) + ": ";
      const ImageError error = compareToReference(draw(scene, with(view, combination)), expected, view.background);
      EXPECT_LE(error.largest, 2) << what << error.worst;
      EXPECT_GE(error.psnr(), kLeastPsnr) << what;
      EXPECT_GT(error.drawn * 20, expected.pixels.size()) << what << "too little to see";
      const ProbeError hit_error =
          compareHits(draw(scene, with(hit_view, combination)), hits, 1 / unitDistance(scene.info));
      EXPECT_EQ(hit_error.unexcused, 0u) << what << hit_error.worst;
      const ProbeError block_error = compareBlocks(draw(scene, with(blocks_view, combination)), blocks);
      EXPECT_EQ(block_error.unexcused, 0u) << what << block_error.worst;
    }
  }
};

TEST_F(ExtremesTest, CornersFacesAndAxes) {
  Scene scene = makeScene(*makeSynthetic({.dims = {100, 97, 96}, .seed = 7}));
  const reference::DenseVolume dense = scene.dense(0);
  for (const NamedView& named : views(scene.info)) expectTruth(scene, dense, named);
}

TEST_F(ExtremesTest, CornersFacesAndAxesOfAnObliqueVolume) {
  Scene scene = makeScene(
      *makeSynthetic({.type = VoxelType::u8, .dims = {100, 97, 96}, .seed = 8, .world_from_index = obliqueMap(true)}));
  const reference::DenseVolume dense = scene.dense(0);
  for (const NamedView& named : views(scene.info)) expectTruth(scene, dense, named);
}

TEST_F(ExtremesTest, FarEyes) {
  for (const glm::dmat4& map : {glm::dmat4(1.0), obliqueMap(false)}) {
    Scene scene = makeScene(*makeSynthetic({.dims = {100, 97, 96}, .seed = 7, .world_from_index = map}));
    const reference::DenseVolume dense = scene.dense(0);
    for (double distance : {1e4, 1e6}) {
      NamedView named{fmt::format("eye {} voxels away", distance),
                      indexView(scene.info, glm::dvec3(0.3, 0.4, 0.87) * distance, {50, 48, 48}, {0, 1, 0})};
      const WorldBox box = worldBox(scene.info);
      const double radius = glm::length(box.max - box.min) / 2;
      named.view.fov_degrees =
          2 * std::atan(radius / glm::length(*named.view.eye - *named.view.target)) * 180 / std::numbers::pi;
      expectTruth(scene, dense, named);
    }
  }
}

}  // namespace
}  // namespace blockwalk::test
