// SPDX-License-Identifier: Apache-2.0
// A renderer for tests of the server: quick, deterministic, and as slow or broken as a test asks for.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "renderer/renderer.h"

namespace blockwalk {

// Shared by the test and the renderer's thread.
struct FakeControl {
  std::atomic<int> bands = 1;        // of each frame
  std::atomic<int> band_ms = 0;      // at the frame's full size; fewer pixels take less
  std::atomic<int> full_pixels = 0;  // of the size that band_ms is for; 0: every size takes it
  std::atomic<bool> hold_load = false;
  std::atomic<bool> read_voxels = false;  // render() reads level 0 from the file
  std::atomic<bool> fail_device = false;  // render() throws DeviceError
  std::atomic<bool> fail_memory = false;  // render() throws bad_alloc
  std::atomic<int> samples = 0;           // of the newest frame
  std::atomic<int> fewest_samples = 0;    // of all frames; 0: none yet
  std::atomic<int> started = 0;
  std::atomic<int> finished = 0;
  std::atomic<int> cancelled = 0;

  void addStep(const SampleStep& step) {
    const std::lock_guard lock(mutex_);
    steps_.push_back(step);
  }
  std::vector<SampleStep> takenSteps() {
    const std::lock_guard lock(mutex_);
    return steps_;
  }

 private:
  std::mutex mutex_;
  std::vector<SampleStep> steps_;  // of refinements, in the order in which they began
};

class FakeVolume final : public ResidentVolume {
 public:
  explicit FakeVolume(VolumeFile file) : file_(std::move(file)) {}
  const VolumeInfo& info() const override { return file_.info(); }
  std::uint64_t deviceBytes() const override { return 1; }
  std::vector<ResidentPart> parts() const override {
    return {{.what = "voxels", .level = 0, .apron = false, .bytes = 1}};
  }
  void readVoxels() const {
    std::vector<std::byte> voxels(static_cast<std::size_t>(info().levels[0].voxel_bytes));
    file_.readVoxels(0, 0, 0, info().levels[0].subblock_count, voxels);
  }

 private:
  VolumeFile file_;
};

class FakeRenderer final : public Renderer {
 public:
  explicit FakeRenderer(std::shared_ptr<FakeControl> control) : control_(std::move(control)) {}

  DeviceInfo device() const override {
    return {.name = "fake", .driver = "none", .driver_version = "1", .api_version = "1", .kind = "software"};
  }

  std::unique_ptr<ResidentVolume> load(VolumeFile file) override {
    while (control_->hold_load) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    return std::make_unique<FakeVolume>(std::move(file));
  }

  std::unique_ptr<FrameInProgress> begin(ResidentVolume& volume, FrameOrder order) override {
    return std::make_unique<FakeFrame>(*this, volume, std::move(order));
  }

 private:
  class FakeFrame final : public FrameInProgress {
   public:
    FakeFrame(FakeRenderer& renderer, ResidentVolume& volume, FrameOrder order)
        : renderer_(renderer), volume_(volume), order_(std::move(order)) {}
    bool advance() override {
      frame_ = renderer_.draw(volume_, order_);
      return false;
    }
    Frame finish() override { return std::move(frame_); }

   private:
    FakeRenderer& renderer_;
    ResidentVolume& volume_;
    FrameOrder order_;
    Frame frame_;
  };

  // A gradient that tells views apart: the eye's x and the size are in every pixel.
  Frame draw(ResidentVolume& volume, const FrameOrder& order) {
    const ResolvedView& view = order.view;
    control_->samples = view.samples;
    const int fewest = control_->fewest_samples;
    control_->fewest_samples = fewest == 0 ? view.samples : std::min(fewest, view.samples);
    if (order.step) control_->addStep(*order.step);
    ++control_->started;
    if (control_->fail_device) throw DeviceError("the fake device was told to refuse");
    if (control_->fail_memory) throw std::bad_alloc();
    if (control_->read_voxels) dynamic_cast<const FakeVolume&>(volume).readVoxels();
    Frame frame{.width = view.width, .height = view.height, .pixels = {}, .probes = {}, .stats = {}};
    const double share = control_->full_pixels == 0 ? 1 : double{1} * view.width * view.height / control_->full_pixels;
    for (int band = 0; band < control_->bands; ++band) {
      std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(share * control_->band_ms));
      if (order.cancel != nullptr && *order.cancel) {
        ++control_->cancelled;
        frame.cancelled = true;
        return frame;
      }
    }
    const auto tint = static_cast<std::uint32_t>(std::abs(view.camera.eye.x) * 1000) & 0xff;
    frame.pixels.reserve(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
    for (int y = 0; y < view.height; ++y) {
      for (int x = 0; x < view.width; ++x) {
        frame.pixels.push_back(static_cast<std::uint32_t>(x & 0xff) | static_cast<std::uint32_t>(y & 0xff) << 8 |
                               tint << 16 | 0xff000000u);
      }
    }
    frame.stats = {.gpu_ms = 1, .total_ms = 1, .rays = frame.pixels.size(), .finder = "grid", .kernel = "fake"};
    ++control_->finished;
    return frame;
  }

  std::shared_ptr<FakeControl> control_;
};

}  // namespace blockwalk
