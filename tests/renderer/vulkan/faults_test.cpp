// SPDX-License-Identifier: Apache-2.0
// A device that fails at any allocation, compilation, submission or wait: the error says how, nothing leaks, and what
// is asked for next is right.
#include <gtest/gtest.h>

#include <map>

#include "renderer/plan/plan.h"
#include "renderer/renderer.h"
#include "renderer/vulkan/device.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk::test {
namespace {

// Makes the n-th of all calls fail, once, and counts them.
struct Fault {
  DeviceFault kind = DeviceFault::none;
  int at = -1;
  int calls = 0;
  std::map<DeviceCall, int> by_call{};

  void arm(DeviceFault fault, int n) {
    kind = fault;
    at = n;
    calls = 0;
  }
  DeviceFault operator()(DeviceCall call) {
    ++by_call[call];
    return calls++ == at ? kind : DeviceFault::none;
  }
};

class FaultsTest : public RendererTest {
 protected:
  FaultsTest() {
    source_ = makeSynthetic({.type = VoxelType::u8, .dims = glm::ivec3(56)});
    path_ = buildFile(*source_);
    view_.width = 64;
    view_.height = 48;
    view_.level = 0;
    view_.samples = 2;
    view_.channels[0].range = DensityRange{.lo = 60, .hi = 200};
  }

  std::unique_ptr<Renderer> makeRenderer() {
    DeviceOptions options;
    options.inject_fault = [this](DeviceCall call) { return fault_(call); };
    return createRenderer(options);
  }
  Frame drawAnew(Renderer& renderer) {
    const auto volume = renderer.load(VolumeFile(path_));
    return renderer.render(*volume, view_);
  }

  std::unique_ptr<Source> source_;
  std::filesystem::path path_;
  View view_;
  Fault fault_;
};

// Each finder makes parts of its own.
class FaultsOf : public FaultsTest, public testing::WithParamInterface<Finder> {
 protected:
  void SetUp() override {
    view_.finder = GetParam();
    const bool asks_rays = GetParam() != Finder::grid && GetParam() != Finder::octree;
    if (asks_rays && !renderer().device().ray_query) GTEST_SKIP() << "this device has no ray queries";
  }
};

INSTANTIATE_TEST_SUITE_P(Finders, FaultsOf,
                         testing::Values(Finder::grid, Finder::octree, Finder::query, Finder::clusters,
                                         Finder::boundary),
                         [](const auto& finder) { return std::string(finderName(finder.param)); });

TEST_P(FaultsOf, OutOfMemoryAtAnyCallFailsThatRequestAlone) {
  const auto renderer = makeRenderer();
  const Frame expected = drawAnew(*renderer);
  EXPECT_GT(fault_.by_call[DeviceCall::allocate], 5);
  EXPECT_GT(fault_.by_call[DeviceCall::create], fault_.by_call[DeviceCall::allocate]);
  EXPECT_GT(fault_.by_call[DeviceCall::submit], 1);
  EXPECT_EQ(fault_.by_call[DeviceCall::wait], fault_.by_call[DeviceCall::submit]);
  EXPECT_GE(fault_.by_call[DeviceCall::compile], 2);  // the frame's, and what finds visible quarters
  EXPECT_EQ(drawAnew(*renderer).pixels, expected.pixels);
  const std::uint64_t used = renderer->device().memory_used_bytes;

  int failed = 0;
  for (int n = 0;; ++n) {
    fault_.arm(DeviceFault::out_of_memory, n);
    const auto again = [&] { EXPECT_EQ(drawAnew(*renderer).pixels, expected.pixels) << "after call " << n; };
    try {
      drawAnew(*renderer);
      if (fault_.calls <= n) break;  // there are no more calls
      again();                       // it did without
    } catch (const OutOfDeviceMemory& error) {
      ++failed;
      EXPECT_NE(std::string_view(error.what()), "");
      again();
    }
    EXPECT_EQ(renderer->device().memory_used_bytes, used) << "after call " << n;
  }
  EXPECT_GT(failed, 5);
}

// Of the very first frame, which makes kernels too.
TEST_P(FaultsOf, OutOfMemoryBeforeAnythingWasMadeLeavesNothingBehind) {
  auto renderer = makeRenderer();
  fault_.arm(DeviceFault::none, -1);
  const Frame expected = drawAnew(*renderer);
  const int calls = fault_.calls;
  for (int n = 1; n < calls; ++n) {
    renderer = makeRenderer();
    fault_.arm(DeviceFault::out_of_memory, n);
    try {
      EXPECT_EQ(drawAnew(*renderer).pixels, expected.pixels) << "call " << n;
    } catch (const OutOfDeviceMemory&) {
    }
    EXPECT_EQ(drawAnew(*renderer).pixels, expected.pixels) << "after call " << n;
  }
}

TEST_P(FaultsOf, ALostDeviceSaysSoAtAnyCallAndEverAfter) {
  auto renderer = makeRenderer();
  fault_.arm(DeviceFault::none, -1);
  const Frame expected = drawAnew(*renderer);
  const int calls = fault_.calls;
  for (int n = 0; n < calls; ++n) {
    renderer = makeRenderer();
    fault_.arm(DeviceFault::lost, n);
    EXPECT_THROW(drawAnew(*renderer), DeviceLost) << "call " << n;
    EXPECT_THROW(drawAnew(*renderer), DeviceLost) << "after call " << n;
  }
  renderer = makeRenderer();
  fault_.arm(DeviceFault::none, -1);
  EXPECT_EQ(drawAnew(*renderer).pixels, expected.pixels);
}

TEST_F(FaultsTest, WithoutMemoryToCompareFindersTheGridServes) {
  std::vector<std::string> notes;
  DeviceOptions options;
  options.inject_fault = [this](DeviceCall call) { return fault_(call); };
  options.probe_software = true;
  options.on_message = [&](const std::string& note) { notes.push_back(note); };
  const auto renderer = createRenderer(options);
  if (!renderer->device().ray_query) GTEST_SKIP() << "one finder alone";
  const Frame expected = drawAnew(*renderer);
  int fell_back = 0;
  for (int n = 0;; ++n) {
    fault_.arm(DeviceFault::none, -1);
    const auto volume = renderer->load(VolumeFile(path_));
    fault_.arm(DeviceFault::out_of_memory, n);
    notes.clear();
    try {
      const Frame frame = renderer->render(*volume, view_);
      EXPECT_EQ(frame.pixels, expected.pixels) << "after call " << n;
      if (fault_.calls <= n) break;
      if (!notes.empty()) {
        EXPECT_NE(notes[0].find("the grid serves"), std::string::npos) << notes[0];
        EXPECT_EQ(frame.stats.finder, "grid");
        ++fell_back;
      }
    } catch (const OutOfDeviceMemory&) {
      // Of what the grid needs too.
    }
  }
  EXPECT_GT(fell_back, 2);
}

TEST_F(FaultsTest, WhatDoesNotAnswerInTimeIsALostDevice) {
  DeviceOptions options;
  options.longest_wait = std::chrono::milliseconds(50);
  const Device device(options);
  const vk::raii::Fence never = device.handle().createFence({});
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THROW(device.wait(*never), DeviceLost);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(50));
  EXPECT_TRUE(device.calls().isLost());
  EXPECT_THROW(device.submitAndWait([](const vk::raii::CommandBuffer&) {}), DeviceLost);
}

}  // namespace
}  // namespace blockwalk::test
