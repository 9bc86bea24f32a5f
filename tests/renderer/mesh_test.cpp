// SPDX-License-Identifier: Apache-2.0
// Output mesh: the edges of what a finder has found, over the picture (docs/integration.md, "Outputs"), against cells
// that the float64 reference walks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/reference/analytic.h"
#include "tests/reference/cut_ray.h"
#include "tests/reference/dense_source.h"
#include "tests/reference/field.h"
#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk::test {
namespace {

constexpr glm::ivec3 kDims{70, 64, 57};
constexpr double kFov = 30;

struct MeshCase {
  Finder finder;
  int macrocell;
  int side;  // voxels of the cells that it finds
};

// Cells of `side` voxels in which a subblock is stored.
class StoredCells {
 public:
  StoredCells(const reference::DenseVolume& dense, int side) : side_(side), dims_((kDims + side - 1) / side) {
    stored_.resize(static_cast<std::size_t>(dims_.x * dims_.y * dims_.z));
    for (int v = 0; v < kDims.x * kDims.y * kDims.z; ++v) {
      const glm::ivec3 voxel(v % kDims.x, v / kDims.x % kDims.y, v / (kDims.x * kDims.y));
      if (!reference::isEmpty(dense, dense.density[dense.at(voxel)])) stored_[at(voxel / side)] = true;
    }
  }
  bool holds(glm::ivec3 cell) const { return stored_[at(cell)]; }

  // Where the ray enters the first of them, and the distance in voxels from there to the nearest edge of the face;
  // infinite where it meets none or begins inside.
  double distanceToEdge(const reference::CutRay& cut, double& t) const {
    bool first = true;
    double distance = std::numeric_limits<double>::infinity();
    reference::walkCells(cut.ray, side_, cut.interval, [&](glm::ivec3 cell, reference::Interval piece) {
      const bool inside = first && cut.starts_inside;
      first = false;
      if (!holds(cell)) return true;
      t = piece.t_min;
      if (!inside) distance = middleDistance(cut.ray.at(t));
      return false;
    });
    return distance;
  }

 private:
  std::size_t at(glm::ivec3 cell) const {
    return static_cast<std::size_t>(cell.x + dims_.x * (cell.y + dims_.y * cell.z));
  }
  // Of the three distances to planes of the lattice: the least is to the face's own, the next to its nearest edge.
  double middleDistance(glm::dvec3 point) const {
    std::array<double, 3> away{};
    for (int a = 0; a < 3; ++a) {
      const double cells = point[a] / side_;
      away[static_cast<std::size_t>(a)] =
          std::min(side_ * std::abs(cells - std::round(cells)), std::abs(point[a] - kDims[a]));
    }
    std::ranges::sort(away);
    return away[1];
  }

  int side_;
  glm::ivec3 dims_;
  std::vector<bool> stored_;
};

class MeshTest : public RendererTest {
 protected:
  static View viewFrom(glm::dvec3 eye) {
    View view;
    view.width = 240;
    view.height = 180;
    view.eye = eye;
    view.target = glm::dvec3(kDims) / 2.0;
    view.fov_degrees = kFov;
    view.level = 0;
    return view;
  }
};

TEST_F(MeshTest, EdgesAreWhereTheRayEntersWhatTheFinderHasFound) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = kDims}));
  const reference::DenseVolume dense = scene.dense(0);
  std::vector<MeshCase> cases = {{Finder::grid, 0, 48}, {Finder::octree, 0, 8}};
  if (renderer().device().ray_query) {
    cases.insert(cases.end(), {{Finder::query, 0, 48}, {Finder::boundary, 8, 8}, {Finder::boundary, 16, 16}});
  }
  for (const MeshCase& mesh : cases) {
    const StoredCells cells(dense, mesh.side);
    std::size_t on_edge = 0;
    std::size_t beside = 0;
    for (const glm::dvec3& eye : {glm::dvec3(150, 120, 160), glm::dvec3(-60, 90, -40), glm::dvec3(35, 32, 190)}) {
      View view = viewFrom(eye);
      view.finder = mesh.finder;
      view.macrocell = mesh.macrocell;
      const View resolved = spellOut(resolveView(view, scene.info));
      const Frame color = draw(scene, resolved);
      view.output = Output::mesh;
      const Frame frame = draw(scene, spellOut(resolveView(view, scene.info)));
      for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
        const auto width = static_cast<std::size_t>(view.width);
        const reference::CutRay cut =
            reference::cutRay(dense, resolved, static_cast<int>(i % width), static_cast<int>(i / width));
        double t = 0;
        const double distance = cells.distanceToEdge(cut, t);
        const double pixel = 2 * t * std::tan(kFov / 2 * std::numbers::pi / 180) / view.height;
        if (distance < 0.2 * pixel && pixel < 0.1 * mesh.side) {
          ++on_edge;
          EXPECT_NEAR(frame.pixels[i] & 255u, 0.85 * 255 + 0.15 * (color.pixels[i] & 255u), 2) << toString(resolved);
        } else if (distance > 1.3 * pixel) {
          ++beside;
          EXPECT_EQ(frame.pixels[i], color.pixels[i]) << i << ' ' << toString(resolved);
        }
      }
    }
    EXPECT_GT(on_edge, 200u) << mesh.side;
    EXPECT_GT(beside, 60000u) << mesh.side;
  }
}

// Which boxes there are is the merging's business; their edges lie on edges of macrocells.
TEST_F(MeshTest, EdgesOfClustersAreEdgesOfMacrocells) {
  if (!renderer().device().ray_query) GTEST_SKIP() << "the device has no ray queries: no clusters";
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = kDims}));
  View view = viewFrom({150, 120, 160});
  view.finder = Finder::clusters;
  const Frame color = draw(scene, spellOut(resolveView(view, scene.info)));
  view.output = Output::mesh;
  const Frame clusters = draw(scene, spellOut(resolveView(view, scene.info)));
  view.finder = Finder::boundary;
  const Frame boundary = draw(scene, spellOut(resolveView(view, scene.info)));
  std::size_t edges = 0;
  std::size_t cells_edges = 0;
  for (std::size_t i = 0; i < color.pixels.size(); ++i) {
    edges += clusters.pixels[i] != color.pixels[i] ? 1 : 0;
    cells_edges += boundary.pixels[i] != color.pixels[i] ? 1 : 0;
    EXPECT_TRUE(clusters.pixels[i] == color.pixels[i] || boundary.pixels[i] != color.pixels[i]) << i;
  }
  EXPECT_GT(edges, 1000u);
  EXPECT_LT(edges, cells_edges);
}

// An eye, or a clip plane, inside of what is found has no face before it.
TEST_F(MeshTest, NothingIsDrawnFromInside) {
  Scene scene = makeScene(
      *reference::makeDenseSource(reference::sampled(reference::constantField(200), VoxelType::u8, {48, 48, 48})));
  View view = viewFrom({24.3, 23.8, 25.1});
  view.target = glm::dvec3(3, 30, 9);
  const Frame color = draw(scene, spellOut(resolveView(view, scene.info)));
  view.output = Output::mesh;
  EXPECT_EQ(draw(scene, spellOut(resolveView(view, scene.info))).pixels, color.pixels);
}

TEST_F(MeshTest, IsRefusedWhereNothingIsFound) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {40, 40, 40}}));
  View view;
  view.output = Output::mesh;
  view.finder = Finder::none;
  try {
    resolveView(view, scene.info);
    FAIL() << "was resolved";
  } catch (const ViewError& error) {
    EXPECT_EQ(error.field, "output");
  }
}

}  // namespace
}  // namespace blockwalk::test
