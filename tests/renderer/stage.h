// SPDX-License-Identifier: Apache-2.0
// What the renderer's tests share: one renderer a process with validation on, volumes built into a temporary folder,
// and images that are checked for NaN, loop bounds and size before a test sees them.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "renderer/renderer.h"
#include "tests/reference/reference.h"
#include "volume/build/builder.h"
#include "volume/source.h"

namespace blockwalk::test {

// A built volume, resident on the process's renderer.
struct Scene {
  std::filesystem::path path;
  VolumeInfo info;
  std::unique_ptr<ResidentVolume> resident;

  reference::DenseVolume dense(int level, std::size_t channel = 0) const {
    return reference::volumeFromFile(VolumeFile(path), level, channel);
  }
};

// Environment BLOCKWALK_DATA, else ../shared/data beside the sources.
std::filesystem::path dataFolder();

// How to draw: one of the finder x walk x cull pairs.
struct Combination {
  Finder finder = Finder::automatic;
  bool walk = true;
  bool cull = true;
};

std::string toString(const Combination& combination);
std::string toString(const View& view);

// Every test ends with no validation message.
class RendererTest : public ::testing::Test {
 protected:
  static Renderer& renderer();
  // Messages so far that are not one-time notes.
  static std::vector<std::string> validationMessages();

  // Builds the volume into a temporary file and makes it resident.
  static Scene makeScene(Source& source, const BuildOptions& options = {});
  // Those of the finders that ask for blocks, which the device can do; the first is the one the others are compared
  // with.
  static std::vector<Combination> combinations();
  // These, and each of the device's other finders once. They are many kernels, and most of a test's time is their
  // making.
  static std::vector<Combination> everyFinder();
  // These, and all of the other finders. `none` neither walks nor culls: it is there once
  // (tests/renderer/plan/plan_test.cpp).
  static std::vector<Combination> allCombinations();
  static std::vector<Finder> otherFinders();

  static View with(View view, const Combination& combination);
  // Another volume file with the same voxels, not resident.
  static std::filesystem::path buildFile(Source& source, const BuildOptions& options = {});

  // Renders with counters and probes and expects a whole, finite frame.
  static Frame draw(Scene& scene, const View& view);
  static Frame draw(Renderer& other, ResidentVolume& volume, const View& view);

  void TearDown() override;
};

// Tests with a renderer of their own options, and a volume on it.
class OwnRendererTest : public RendererTest {
 protected:
  // With validation.
  std::unique_ptr<Renderer> create(DeviceOptions options);
  // In place of what there was.
  void start(const std::filesystem::path& file, const DeviceOptions& options);
  FrameOrder orderOf(const View& view) const { return {.view = resolveView(view, volume_->info())}; }

  void TearDown() override;

  std::vector<std::string> messages_;  // none may be left at the end
  std::vector<std::string> notes_;     // on what the finder auto is
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<ResidentVolume> volume_;
};

}  // namespace blockwalk::test
