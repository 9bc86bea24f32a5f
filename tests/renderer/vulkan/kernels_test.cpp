// SPDX-License-Identifier: Apache-2.0
// Kernels: a bounded number, and none that a view waits for but its family's first.
#include "renderer/vulkan/kernels.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "renderer/vulkan/device.h"
#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk::test {
namespace {

// Cheap to compile, and all of one family: the filter and the finder are theirs.
KernelKey keyOf(std::uint32_t mode, bool lit = false) {
  KernelKey key{};
  key.voxel_type = gpu::kVoxelU8;
  key.mode = mode;
  key.lit = lit ? 1 : 0;
  key.count = 0;
  return key;
}

// Until `holds`, for a minute.
template <typename Condition>
bool eventually(const Condition& holds) {
  for (const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
       std::chrono::steady_clock::now() < end;) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

class KernelsTest : public testing::Test {
 protected:
  Device device{DeviceOptions{}};
};

TEST_F(KernelsTest, KeepsNoMoreThanItMayAndTheLastUsed) {
  Kernels kernels(device, false, 2);
  const auto choose = [&](std::uint32_t mode) { return kernels.choose(keyOf(mode), KernelWish::best); };
  const Kernels::Kernel blend = choose(gpu::kModeBlend);
  choose(gpu::kModeMip);
  EXPECT_EQ(choose(gpu::kModeBlend).pipeline, blend.pipeline);
  EXPECT_EQ(kernels.made(), 2u);
  choose(gpu::kModeMean);  // in place of mip
  EXPECT_EQ(kernels.ready(), 2u);
  EXPECT_EQ(choose(gpu::kModeBlend).pipeline, blend.pipeline);
  choose(gpu::kModeMip);
  EXPECT_EQ(kernels.made(), 4u);
  choose(gpu::kModeMean);
  choose(gpu::kModeIso);
  EXPECT_EQ(kernels.ready(), 2u);
  EXPECT_TRUE(**blend.pipeline);  // whoever draws with it keeps it
  EXPECT_NE(choose(gpu::kModeBlend).pipeline, blend.pipeline);
}

TEST_F(KernelsTest, FamiliesAreOfEqualEarlyChoices) {
  EXPECT_EQ(generalKernel(keyOf(gpu::kModeBlend)), generalKernel(keyOf(gpu::kModeMip, true)));
  KernelKey linear = keyOf(gpu::kModeBlend);
  linear.filter = gpu::kFilterLinear;
  EXPECT_NE(generalKernel(linear), generalKernel(keyOf(gpu::kModeBlend)));
  EXPECT_NE(generalKernel(linear), (KernelName{.key = linear}));
}

TEST_F(KernelsTest, NoViewWaitsButAFamilysFirst) {
  Kernels kernels(device, true, 16);
  const auto choose = [&](const KernelKey& key) { return kernels.choose(key, KernelWish::best); };
  const KernelKey first = keyOf(gpu::kModeBlend);
  EXPECT_FALSE(choose(first).general);
  EXPECT_EQ(kernels.made(), 1u);
  ASSERT_TRUE(eventually([&] { return choose(first).pipeline && kernels.ready() == 2; })) << "no general kernel";

  const KernelKey other = keyOf(gpu::kModeMip);
  EXPECT_TRUE(choose(other).general);
  EXPECT_EQ(kernels.made(), 2u);
  EXPECT_TRUE(eventually([&] { return !choose(other).general; })) << "what is drawn again gets its own";
  EXPECT_EQ(kernels.made(), 3u);

  // Once is not worth a kernel, and an expert's choice never is.
  EXPECT_TRUE(choose(keyOf(gpu::kModeMean)).general);
  KernelKey standing = keyOf(gpu::kModeIso);
  standing.walk = 0;
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(choose(standing).general);
  KernelKey costs = keyOf(gpu::kModeIso);
  costs.output = gpu::kOutputCost;
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(choose(costs).general);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  choose(first);
  EXPECT_EQ(kernels.made(), 3u);

  EXPECT_FALSE(kernels.choose(standing, KernelWish::specialised).general);
  EXPECT_TRUE(kernels.choose(first, KernelWish::general).general);
}

class BackgroundKernelsTest : public RendererTest {};

TEST_F(BackgroundKernelsTest, DrawWhatTheKernelsDrawThatViewsWaitFor) {
  const auto source = makeSynthetic({.type = VoxelType::u16, .dims = glm::ivec3(56)});
  Scene scene = makeScene(*source);
  DeviceOptions options;
  options.background_kernels = true;
  const std::unique_ptr<Renderer> shared = createRenderer(options);
  const auto volume = shared->load(VolumeFile(scene.path));
  View view;
  view.width = 72;
  view.height = 56;
  view.level = 0;
  int generals = 0;
  for (const Mode mode : {Mode::blend, Mode::mip, Mode::first_hit}) {
    for (const bool lit : {false, true}) {
      view.mode = mode;
      view.lit = lit;
      const Frame expected = draw(scene, view);
      const auto drawsIt = [&] {
        const Frame frame = shared->render(*volume, view, {.probe = true});
        EXPECT_EQ(frame.pixels, expected.pixels) << toString(view) << frame.stats.kernel;
        const bool general = frame.stats.kernel.starts_with("general ");
        generals += general ? 1 : 0;
        return !general;
      };
      drawsIt();
      drawsIt();
      const Frame own = shared->render(*volume, view, {.specialised = true});
      EXPECT_FALSE(own.stats.kernel.starts_with("general ")) << own.stats.kernel;
      EXPECT_EQ(own.pixels, expected.pixels);
    }
  }
  EXPECT_GT(generals, 0);
}

}  // namespace
}  // namespace blockwalk::test
