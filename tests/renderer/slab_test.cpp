// SPDX-License-Identifier: Apache-2.0
// An average slab in 3D: mode `mean` between two planes is what a slice's slab has as its mean.
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"
#include "view/resolved_view.h"
#include "volume/slice/slice_reader.h"

namespace blockwalk::test {
namespace {

constexpr glm::ivec3 kSlabDims(40, 32, 50);

// No voxel of it is empty.
std::unique_ptr<Source> full() {
  return makeVoxels(kSlabDims, [](glm::ivec3 p) { return 1 + (7 * p.x + 31 * p.y + 53 * p.z) % 254; });
}

class SlabTest : public RendererTest {};

TEST_F(SlabTest, OfTheMeanIsThatOfASlice) {
  Scene scene = makeScene(*full());
  const VolumeFile file(scene.path);
  const SlicePlan plan =
      planSlice(file.info(), {.plane = AxisCut{.axis = 2, .index = 20, .thickness = 9}, .reduce = SliceReduce::mean});
  const std::unique_ptr<SliceReader> reader = makeSliceReader(file, plan);
  while (reader->step()) {
  }
  const SlicePixels slice = reader->take();
  // From behind row 0 and column 0 lie as in the file: a pixel a voxel.
  View view;
  view.width = kSlabDims.x;
  view.height = kSlabDims.y;
  view.ortho_height = kSlabDims.y;
  view.target = 0.5 * glm::dvec3(kSlabDims);
  view.eye = *view.target - glm::dvec3(0, 0, 100);
  view.up = glm::dvec3(0, -1, 0);
  view.mode = Mode::mean;
  view.output = Output::value;
  view.planes = {{.normal = {0, 0, 1}, .offset = -16}, {.normal = {0, 0, -1}, .offset = 25}};
  for (const Filter filter : {Filter::nearest, Filter::linear}) {
    view.filter = filter;
    // Interpolated, the two ends of the slab are means with what lies behind them.
    const double slack = filter == Filter::nearest ? 1e-3 : 254.0 / 9;
    const Frame frame = draw(scene, view);
    ASSERT_EQ(frame.values.size(), slice.values[0].size());
    for (std::size_t i = 0; i < frame.values.size(); ++i) {
      ASSERT_NEAR(frame.values[i], slice.values[0][i], slack) << i << " filter " << static_cast<int>(filter);
    }
  }
}

}  // namespace
}  // namespace blockwalk::test
