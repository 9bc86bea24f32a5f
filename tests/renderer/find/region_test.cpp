// SPDX-License-Identifier: Apache-2.0
// Active regions: which macrocells are active, how many faces bound them, and when they are built anew.
#include <gtest/gtest.h>

#include "renderer/plan/visible_densities.h"
#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

constexpr Finder kRegionFinders[] = {Finder::clusters, Finder::boundary};

// Macrocells of `side` voxels with a visible voxel of the dense volume in the range, grown to whole subblocks by what
// their records say.
class Macrocells {
 public:
  Macrocells(const Scene& scene, int side, DensityRange range)
      : dims_((scene.info.levels[0].dims + (side - 1)) / side),
        active_(static_cast<std::size_t>(dims_.x * dims_.y * dims_.z)) {
    const VolumeFile file(scene.path);
    const Level level = file.readLevel(0, 0);
    const ChannelInfo& channel = scene.info.channels[0];
    std::uint8_t wanted = 0;
    const auto lo = static_cast<float>(channel.storedFromData(range.lo));
    const auto hi = static_cast<float>(channel.storedFromData(range.hi));
    for (int bin = rangeMaskBin(channel.bin_cuts, lo); bin <= rangeMaskBin(channel.bin_cuts, hi); ++bin) {
      wanted |= static_cast<std::uint8_t>(1 << bin);
    }
    struct Range {
      float lo = 1e30F, hi = -1e30F;
      std::uint8_t mask = 0;
    };
    std::vector<Range> ranges(active_.size());
    for (const Block& block : level.blocks) {
      std::size_t rank = 0;
      const int count = scene.info.block_side;
      for (int local = 0; local < count * count * count; ++local) {
        if ((block.occupancy[static_cast<std::size_t>(local / 64)] >> (local % 64) & 1) == 0) continue;
        const Subblock& record = level.subblocks[block.first_subblock + rank++];
        const glm::ivec3 place(local % count, local / count % count, local / (count * count));
        const glm::ivec3 macrocell = (block.origin * count + place) * scene.info.subblock_side / side;
        Range& of_macrocell = ranges[index(macrocell)];
        of_macrocell.lo = std::min(of_macrocell.lo, record.density_min);
        of_macrocell.hi = std::max(of_macrocell.hi, record.density_max);
        of_macrocell.mask |= record.range_mask;
      }
    }
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      active_[i] = (ranges[i].mask & wanted) != 0 && ranges[i].hi >= lo && ranges[i].lo <= hi;
    }
  }

  std::uint64_t activeCount() const {
    return static_cast<std::uint64_t>(std::count(active_.begin(), active_.end(), true));
  }

  std::uint64_t faceCount() const {
    std::uint64_t faces = 0;
    for (int z = 0; z < dims_.z; ++z) {
      for (int y = 0; y < dims_.y; ++y) {
        for (int x = 0; x < dims_.x; ++x) {
          if (!isActive({x, y, z})) continue;
          for (int axis = 0; axis < 3; ++axis) {
            glm::ivec3 step(0);
            step[axis] = 1;
            faces += (isActive(glm::ivec3(x, y, z) + step) ? 0 : 1) + (isActive(glm::ivec3(x, y, z) - step) ? 0 : 1);
          }
        }
      }
    }
    return faces;
  }

 private:
  std::size_t index(glm::ivec3 macrocell) const {
    return static_cast<std::size_t>(macrocell.x + dims_.x * (macrocell.y + dims_.y * macrocell.z));
  }
  bool isActive(glm::ivec3 macrocell) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (macrocell[axis] < 0 || macrocell[axis] >= dims_[axis]) return false;
    }
    return active_[index(macrocell)];
  }

  glm::ivec3 dims_;
  std::vector<bool> active_;
};

class RegionTest : public RendererTest {
 protected:
  void SetUp() override {
    if (!renderer().device().ray_query) GTEST_SKIP() << "no ray queries";
  }

  static FinderBuild buildOf(Scene& scene, View view, Finder finder) {
    view.finder = finder;
    return draw(scene, view).stats.finder_build;
  }

  static View smallView(DensityRange range) {
    View view;
    view.width = 40;
    view.height = 30;
    view.level = 0;
    view.channels[0].range = range;
    return view;
  }
};

TEST_F(RegionTest, HasTheFacesBetweenActiveAndInactiveMacrocells) {
  BuildOptions options;
  options.subblock_side = 4;
  options.block_side = 5;
  for (const bool paper_blocks : {false, true}) {
    Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}),
                            paper_blocks ? BuildOptions{} : options);
    for (const DensityRange& range : {DensityRange{1, 255}, DensityRange{200, 255}, DensityRange{30, 34}}) {
      for (int side : {8, 16, 32}) {
        View view = smallView(range);
        view.macrocell = side;
        const Macrocells macrocells(scene, side, range);
        const FinderBuild boundary = buildOf(scene, view, Finder::boundary);
        EXPECT_EQ(boundary.macrocell_voxels, side);
        EXPECT_EQ(boundary.active_macrocells, macrocells.activeCount());
        EXPECT_GT(boundary.active_macrocells, 0u);
        EXPECT_EQ(boundary.primitives, 2 * macrocells.faceCount());
        const FinderBuild clusters = buildOf(scene, view, Finder::clusters);
        EXPECT_EQ(clusters.active_macrocells, macrocells.activeCount());
        EXPECT_GT(clusters.primitives, 0u);
        EXPECT_LE(clusters.primitives, clusters.active_macrocells);
      }
    }
  }
}

TEST_F(RegionTest, IsBuiltAnewOnlyWhenItChanges) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::u8, .dims = {70, 64, 57}, .seed = 2}));
  for (Finder finder : kRegionFinders) {
    View view = smallView(DensityRange{50, 200});
    view.channels[0].transfer = {{.value = 0, .color = glm::dvec3(1), .opacity = 0.2},
                                 {.value = 255, .color = glm::dvec3(1), .opacity = 0.2}};
    EXPECT_TRUE(buildOf(scene, view, finder).rebuilt);
    EXPECT_FALSE(buildOf(scene, view, finder).rebuilt);
    view.eye = glm::dvec3(-50, 20, 30);
    view.channels[0].transfer[0].color = glm::dvec3(1, 0, 0);
    view.channels[0].transfer[1].opacity = 0.7;
    EXPECT_FALSE(buildOf(scene, view, finder).rebuilt) << "neither a camera nor a colour moves the boundary";
    view.channels[0].range = DensityRange{51, 200};
    EXPECT_TRUE(buildOf(scene, view, finder).rebuilt);
    view.channels[0].transfer[0].opacity = 0;
    view.channels[0].transfer.insert(view.channels[0].transfer.begin() + 1,
                                     {.value = 120, .color = glm::dvec3(1), .opacity = 0});
    const FinderBuild built = buildOf(scene, view, finder);
    EXPECT_TRUE(built.rebuilt);
    EXPECT_GE(built.total_ms, built.tf_ms + built.tris_ms + built.bvh_ms);
    view.macrocell = 16;
    EXPECT_TRUE(buildOf(scene, view, finder).rebuilt);
    view.filter = Filter::linear;
    EXPECT_TRUE(buildOf(scene, view, finder).rebuilt);
  }
}

// A frame in which no macrocell is active, and the one after it.
TEST_F(RegionTest, MayBeEmpty) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::f32, .dims = {64, 51, 70}, .seed = 4}));
  const double hi = scene.info.channels[0].dataFromStored(static_cast<double>(scene.info.channels[0].density_max));
  const double lo = scene.info.channels[0].dataFromStored(static_cast<double>(scene.info.channels[0].density_min));
  for (Finder finder : kRegionFinders) {
    View view = smallView({lo, hi});
    view.finder = finder;
    view.mode = Mode::mip;
    view.channels[0].range = DensityRange{lo * 0.5, lo * 0.75};  // above what is empty, below every voxel
    const Frame none = draw(scene, view);
    EXPECT_GT(none.stats.finder_build.macrocells, 0u);
    EXPECT_EQ(none.stats.finder_build.active_macrocells, 0u);
    EXPECT_EQ(std::count(none.pixels.begin(), none.pixels.end(), none.pixels[0]),
              static_cast<std::ptrdiff_t>(none.pixels.size()));
    view.channels[0].range.reset();
    const Frame some = draw(scene, view);
    EXPECT_GT(some.stats.finder_build.active_macrocells, 0u);
    view.finder = Finder::grid;
    EXPECT_LE(compareImages(some, draw(scene, view)).largest, 1);
  }
}

// Every size of macrocell, below, at and above that of a block, gives the image of the grid.
TEST_F(RegionTest, OfEveryMacrocellSideGivesTheSameImage) {
  Scene scene = makeScene(*makeSynthetic(
      {.type = VoxelType::u16, .dims = {61, 100, 49}, .seed = 3, .world_from_index = obliqueMap(false)}));
  const std::vector<View> views = randomViews(scene.info, scene.dense(0), 61);
  for (std::size_t v : {1u, 4u, 6u, 10u, 14u}) {
    for (Filter filter : {Filter::nearest, Filter::linear}) {
      View view = views[v];
      view.filter = filter;
      const Frame expected = draw(scene, with(view, {.finder = Finder::grid}));
      for (Finder finder : kRegionFinders) {
        for (int side : {8, 16, 32}) {
          view.macrocell = side;
          const ImageError error = compareImages(draw(scene, with(view, {.finder = finder})), expected);
          EXPECT_LE(error.largest, 1) << "macrocells of " << side << ", " << toString(Combination{.finder = finder})
                                      << ": " << error.worst << "\n  view " << toString(view);
        }
      }
    }
  }
}

// What the device takes is built, and not one more. It is nothing of the device's: other finders serve, and smaller
// regions.
TEST_F(RegionTest, OfMoreThanTheDeviceTakesIsRefused) {
  const auto file = buildFile(*makeSynthetic({.type = VoxelType::u8, .dims = {64, 64, 64}, .seed = 2}));
  std::vector<std::string> messages;
  const auto drawWith = [&](std::uint64_t most, const View& view) {
    DeviceOptions options;
    options.validation = true;
    options.on_message = [&messages](const std::string& text) { messages.push_back(text); };
    options.max_primitives = most;
    const std::unique_ptr<Renderer> limited = createRenderer(options);
    const auto volume = limited->load(VolumeFile(file));
    return limited->render(*volume, view);
  };
  for (const Finder finder : kRegionFinders) {
    View view = smallView({1, 255});
    view.finder = finder;
    const std::uint64_t primitives = drawWith(~std::uint64_t{0}, view).stats.finder_build.primitives;
    ASSERT_GT(primitives, 1u);
    EXPECT_EQ(drawWith(primitives, view).stats.finder_build.primitives, primitives);
    try {
      drawWith(primitives - 1, view);
      ADD_FAILURE() << finderName(finder) << " with one more than the device takes";
    } catch (const ViewError& error) {
      EXPECT_EQ(error.field, "finder");
    }
  }
  EXPECT_EQ(messages, std::vector<std::string>{});
}

TEST_F(RegionTest, RefusesMacrocellsSmallerThanSubblocks) {
  BuildOptions options;
  options.subblock_side = 16;
  options.block_side = 2;
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::u8, .dims = {64, 64, 64}, .seed = 2}), options);
  View view = smallView({1, 255});
  EXPECT_EQ(buildOf(scene, view, Finder::boundary).macrocell_voxels, 16);
  view.macrocell = 8;
  view.finder = Finder::boundary;
  try {
    draw(scene, view);
    FAIL() << "drawn";
  } catch (const ViewError& error) {
    EXPECT_EQ(error.field, "macrocell");
  }
}

VolumeInfo byteVolume() {
  VolumeInfo info;
  info.type = VoxelType::u8;
  info.dims = {64, 64, 64};
  info.channels[0].density_min = 5;
  info.channels[0].density_max = 250;
  info.channels[0].histogram_hi = 255;
  info.levels.push_back({.dims = info.dims, .block_count = 8, .subblock_count = 64, .voxel_bytes = 0});
  return info;
}

std::vector<StoredRange> densitiesOf(View view, const std::vector<TransferPoint>& points) {
  const VolumeInfo info = byteVolume();
  view.channels[0].transfer = points;
  const ResolvedView resolved = resolveView(view, info);
  const Plan planned = plan(resolved, info, {}, false, false);
  return visibleDensities(resolved, info, planned.channels.at(0), 100);
}

bool isVisible(const std::vector<StoredRange>& ranges, float density) {
  return std::ranges::any_of(ranges, [&](const StoredRange& r) { return r.lo <= density && density <= r.hi; });
}

TEST(VisibleDensities, LeaveOutTransparentStretches) {
  const std::vector<TransferPoint> two_peaks = {{.value = 40, .color = glm::dvec3(1), .opacity = 0},
                                                {.value = 50, .color = glm::dvec3(1), .opacity = 0.5},
                                                {.value = 60, .color = glm::dvec3(1), .opacity = 0},
                                                {.value = 150, .color = glm::dvec3(1), .opacity = 0},
                                                {.value = 160, .color = glm::dvec3(1), .opacity = 0.5}};
  const std::vector<StoredRange> ranges = densitiesOf({}, two_peaks);
  ASSERT_EQ(ranges.size(), 2u);
  for (int density = 5; density <= 250; ++density) {
    const bool opaque = (density > 40 && density < 60) || density > 150;
    const bool beside = density == 40 || density == 60 || density == 150;
    if (!beside) {
      EXPECT_EQ(isVisible(ranges, static_cast<float>(density)), opaque) << density;
    }
  }
  View stepped;
  stepped.transfer_shape = TransferShape::stepped;
  const std::vector<StoredRange> steps = densitiesOf(stepped, two_peaks);
  EXPECT_TRUE(isVisible(steps, 59));
  EXPECT_FALSE(isVisible(steps, 45));
  EXPECT_FALSE(isVisible(steps, 155));
  EXPECT_TRUE(isVisible(steps, 160));
  View mip;
  mip.mode = Mode::mip;
  EXPECT_TRUE(isVisible(densitiesOf(mip, two_peaks), 100)) << "this mode does not look at opacity";
}

}  // namespace
}  // namespace blockwalk::test
