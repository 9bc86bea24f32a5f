// SPDX-License-Identifier: Apache-2.0
// A renderer for tests of the server: quick, deterministic, and as slow or broken as a test asks for.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <mutex>
#include <new>
#include <thread>
#include <vector>

#include "renderer/renderer.h"

namespace blockwalk {

// Shared by the test and the renderer's thread.
struct FakeControl {
  std::atomic<int> bands = 1;        // of each frame: advance() draws one
  std::atomic<int> band_ms = 0;      // at the frame's full size; fewer pixels take less
  std::atomic<int> full_pixels = 0;  // of the size that band_ms is for; 0: every size takes it
  std::atomic<int> band_pixels = 0;  // not 0: a frame of more pixels than `bands` such bands has more bands
  std::atomic<bool> hold_load = false;
  std::atomic<bool> read_voxels = false;   // frames read level 0 from the file
  std::atomic<bool> fail_device = false;   // frames throw DeviceError
  std::atomic<bool> fail_memory = false;   // frames throw bad_alloc
  std::atomic<bool> draw_nothing = false;  // frames say that no pixel of them shows anything
  std::atomic<bool> paged = false;         // frames say that their voxels come and go
  std::atomic<int> ahead_pieces = 1;       // of an order to bring in what may come, a millisecond each
  std::atomic<int> samples = 0;            // of the newest frame
  std::atomic<int> fewest_samples = 0;     // of all frames; 0: none yet
  std::atomic<int> started = 0;
  std::atomic<int> finished = 0;
  std::atomic<int> cancelled = 0;
  std::atomic<int> opened = 0;          // renderers
  std::atomic<int> loads = 0;           // volumes
  std::atomic<int> most_under_way = 0;  // frames begun and neither finished nor given up
  std::atomic<int> under_way = 0;
  std::atomic<int> room = 0;  // not 0: of so many frames at a time; others wait, as FrameInProgress::waits() says
  std::atomic<int> needs_no_room_below = 0;  // pixels of a frame that finds all it needs
  std::atomic<int> holding = 0;              // of those that have room
  std::atomic<int> waited = 0;               // frames that found none
  std::atomic<int> out_of_turn = 0;          // advanced while they waited
  // Time of bands; and of those of frames that are no larger than 64x48.
  std::atomic<std::int64_t> busy_us = 0;
  std::atomic<std::int64_t> small_busy_us = 0;

  // Of the renderer that was told to hang: what is destroyed of it does not return while that is held.
  std::atomic<bool> hold_destruction = false;
  std::atomic<int> destroyed_hung = 0;
  void destroy(int renderer) {
    if (renderer != hung_) return;
    ++destroyed_hung;
    while (hold_destruction) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }

  // The n-th call of the renderer from now on (load, begin or advance) throws this, and so do those after it, `times`
  // in all.
  enum class Fault { none, lost, hangs, out_of_memory, bad_alloc, data };
  void failCall(Fault fault, int n, int times = 1) {
    const std::lock_guard lock(mutex_);
    fault_ = fault;
    calls_left_ = n;
    faults_left_ = times;
  }
  void call() {
    const std::lock_guard lock(mutex_);
    if (faults_left_ == 0 || --calls_left_ > 0) return;
    --faults_left_;
    switch (fault_) {
      case Fault::none:
        return;
      case Fault::lost:
        throw DeviceLost("the fake device was told to be lost");
      case Fault::hangs:
        hung_ = opened.load();
        throw DeviceHangs("the fake device was told to hang");
      case Fault::out_of_memory:
        throw OutOfDeviceMemory("the fake device is full: 123456 bytes are needed, 789 are free", 123456, 789, "level");
      case Fault::bad_alloc:
        throw std::bad_alloc();
      case Fault::data:
        throw DataError("the fake device was told that the file is broken");
    }
  }

  void addStep(const SampleStep& step) {
    const std::lock_guard lock(mutex_);
    steps_.push_back(step);
  }
  std::vector<SampleStep> takenSteps() {
    const std::lock_guard lock(mutex_);
    return steps_;
  }
  void addAhead(const ResolvedView& view) {
    const std::lock_guard lock(mutex_);
    ahead_.push_back(view);
  }
  std::vector<ResolvedView> viewsAhead() {
    const std::lock_guard lock(mutex_);
    return ahead_;
  }
  void addForgotten(std::uint64_t owner) {
    const std::lock_guard lock(mutex_);
    forgotten_.push_back(owner);
  }
  std::vector<std::uint64_t> forgotten() {
    const std::lock_guard lock(mutex_);
    return forgotten_;
  }

 private:
  std::mutex mutex_;
  std::vector<SampleStep> steps_;    // of refinements, in the order in which they began
  std::vector<ResolvedView> ahead_;  // for which something was to be brought in
  std::vector<std::uint64_t> forgotten_;
  Fault fault_ = Fault::none;
  int calls_left_ = 0;
  int faults_left_ = 0;
  std::atomic<int> hung_ = 0;  // the number of the renderer
};

class FakeVolume final : public ResidentVolume {
 public:
  FakeVolume(std::shared_ptr<FakeControl> control, int renderer, VolumeFile file)
      : control_(std::move(control)), renderer_(renderer), file_(std::move(file)) {}
  ~FakeVolume() override { control_->destroy(renderer_); }
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
  std::shared_ptr<FakeControl> control_;
  int renderer_;
  VolumeFile file_;
};

class FakeRenderer final : public Renderer {
 public:
  explicit FakeRenderer(std::shared_ptr<FakeControl> control)
      : control_(std::move(control)), number_(++control_->opened) {}
  ~FakeRenderer() override { control_->destroy(number_); }

  DeviceInfo device() const override {
    return {.name = "fake", .driver = "none", .driver_version = "1", .api_version = "1", .kind = "software"};
  }

  std::unique_ptr<ResidentVolume> load(VolumeFile file) override {
    control_->call();
    ++control_->loads;
    return std::make_unique<FakeVolume>(control_, number_, std::move(file));
  }

  std::unique_ptr<FrameInProgress> begin(ResidentVolume& volume, FrameOrder order) override {
    control_->call();
    return std::make_unique<FakeFrame>(*control_, number_, volume, std::move(order));
  }

  void forget(std::uint64_t owner) noexcept override { control_->addForgotten(owner); }

 private:
  class FakeFrame final : public FrameInProgress {
   public:
    FakeFrame(FakeControl& control, int renderer, ResidentVolume& volume, FrameOrder order)
        : control_(control), renderer_(renderer), volume_(dynamic_cast<FakeVolume&>(volume)), order_(std::move(order)) {
      if (order_.ahead) control_.addAhead(order_.view);
      if (order_.prepare_only || order_.ahead) return;
      const ResolvedView& view = order_.view;
      control_.samples = view.samples;
      const int fewest = control_.fewest_samples;
      control_.fewest_samples = fewest == 0 ? view.samples : std::min(fewest, view.samples);
      if (order_.step) control_.addStep(*order_.step);
      ++control_.started;
      control_.most_under_way = std::max<int>(control_.most_under_way, ++control_.under_way);
      const double pixels = double{1} * view.width * view.height;
      bands_ = control_.bands;
      if (control_.band_pixels != 0) {
        bands_ = std::max(bands_, static_cast<int>(std::ceil(pixels / control_.band_pixels)));
      }
      share_ = control_.full_pixels == 0 ? 1 : pixels / control_.full_pixels;
    }
    ~FakeFrame() override {
      if (!order_.prepare_only && !order_.ahead) --control_.under_way;
      if (holds_) --control_.holding;
      control_.destroy(renderer_);
    }

    bool waits() const override { return waits_ && control_.holding >= control_.room; }

    bool advance() override {
      control_.call();
      if (order_.prepare_only) {
        if (!control_.hold_load || isCancelled()) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        return true;
      }
      if (order_.ahead) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return !isCancelled() && ++band_ < control_.ahead_pieces;
      }
      const bool needs_room = order_.view.width * order_.view.height >= control_.needs_no_room_below;
      if (control_.room != 0 && needs_room && !holds_ && !isCancelled()) {
        if (waits()) ++control_.out_of_turn;
        holds_ = control_.holding < control_.room;
        if (!holds_) {
          control_.waited += waits_ ? 0 : 1;
          return waits_ = true;
        }
        waits_ = false;
        ++control_.holding;
      }
      if (control_.fail_device) throw DeviceError("the fake device was told to refuse");
      if (control_.fail_memory) throw std::bad_alloc();
      if (control_.read_voxels) volume_.readVoxels();
      if (!isCancelled()) {
        const auto begin = std::chrono::steady_clock::now();
        std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(share_ * control_.band_ms));
        const auto took = std::chrono::steady_clock::now() - begin;
        const std::int64_t us = std::chrono::duration_cast<std::chrono::microseconds>(took).count();
        control_.busy_us += us;
        if (order_.view.width * order_.view.height <= 64 * 48) control_.small_busy_us += us;
      }
      return !isCancelled() && ++band_ < bands_;
    }

    // A gradient that tells views apart: the eye's x and the size are in every pixel.
    Frame finish() override {
      const ResolvedView& view = order_.view;
      Frame frame{.width = view.width, .height = view.height, .pixels = {}, .probes = {}, .stats = {}};
      if (order_.prepare_only) return frame;
      frame.cancelled = isCancelled();
      if (order_.ahead) {
        frame.stats.pages_read = 1;
        return frame;
      }
      ++(frame.cancelled ? control_.cancelled : control_.finished);
      if (frame.cancelled) return frame;
      const auto tint = static_cast<std::uint32_t>(std::abs(view.camera.eye.x) * 1000) & 0xff;
      frame.pixels.reserve(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
      for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
          frame.pixels.push_back(static_cast<std::uint32_t>(x & 0xff) | static_cast<std::uint32_t>(y & 0xff) << 8 |
                                 tint << 16 | 0xff000000u);
        }
      }
      frame.stats = {.gpu_ms = 1, .total_ms = 1, .rays = frame.pixels.size(), .finder = "grid", .kernel = "fake"};
      frame.stats.paged = control_.paged;
      frame.stats.drawn_pixels = control_.draw_nothing ? 0 : frame.pixels.size();
      frame.stats.reasons = reasonsOf(view, volume_.info(), frame.stats);
      return frame;
    }

   private:
    bool isCancelled() const { return order_.cancel != nullptr && *order_.cancel; }

    FakeControl& control_;
    int renderer_;
    const FakeVolume& volume_;
    FrameOrder order_;
    int bands_ = 1;
    double share_ = 1;
    int band_ = 0;
    bool holds_ = false;
    bool waits_ = false;
  };

  std::shared_ptr<FakeControl> control_;
  int number_;
};

}  // namespace blockwalk
