// SPDX-License-Identifier: Apache-2.0
// The thread that owns the renderer and the resident volumes. Jobs go in from the socket thread; results come out
// through callbacks, which run on this thread and must only hand them on.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "renderer/renderer.h"
#include "server/render/fair_queue.h"

namespace blockwalk {

using RendererFactory = std::function<std::unique_ptr<Renderer>()>;

struct RenderResult {
  Frame frame;
  double took_ms = 0;
  std::exception_ptr error;  // then there is no frame
};

struct RenderJob {
  std::size_t volume = 0;  // index of the file
  FrameOrder frame;
  std::function<void(RenderResult)> done;  // called once, unless the thread is stopped first
};

// The volume's file could not be loaded, or broke while it was served. The text names the file without its folder.
struct VolumeError : DataError {
  using DataError::DataError;
};

struct LoadedVolume {
  std::shared_ptr<const VolumeInfo> info;
  std::uint64_t file_bytes = 0;
};

struct RenderEvents {
  std::function<void(DeviceInfo)> on_device;  // when there is one, and again when its memory use changes
  std::function<void(std::string)> on_no_device;
  std::function<void(std::size_t volume, LoadedVolume)> on_loaded;
  // Instead of on_loaded, or after it: the volume is not served from now on.
  std::function<void(std::size_t volume, std::string error)> on_failed;
};

class RenderThread {
 public:
  RenderThread(RendererFactory factory, std::vector<std::filesystem::path> files, RenderEvents events);
  ~RenderThread();

  // Waits until there is a device. Throws what the factory threw.
  void waitForDevice() const { device_opened_.get(); }

  // Jobs of different clients share the device by device time.
  void submit(std::uint64_t client, RenderJob job);

  // Cancels the running frame and takes no further job. False when the thread has not ended in time, as loading a
  // volume cannot be interrupted; the process should then end without waiting.
  bool stop(std::chrono::milliseconds patience);

 private:
  void run();
  void loadNext();
  void tellDevice();
  void renderOne(std::uint64_t client, RenderJob job);
  RenderResult renderFrame(const RenderJob& job);
  void fail(std::size_t index, const std::string& reason);

  RendererFactory factory_;
  std::vector<std::filesystem::path> files_;
  RenderEvents events_;
  std::uint64_t told_used_bytes_ = 0;

  std::mutex mutex_;  // guards what follows; never held across a render or a load
  std::condition_variable wake_;
  FairQueue<RenderJob> queue_;
  std::shared_ptr<std::atomic<bool>> running_cancel_;
  bool stopping_ = false;
  bool ended_ = false;

  // The thread's own.
  std::unique_ptr<Renderer> renderer_;
  std::vector<std::unique_ptr<ResidentVolume>> volumes_;
  std::vector<std::string> failures_;  // of the volumes; empty: not failed
  std::promise<void> device_;
  std::shared_future<void> device_opened_ = device_.get_future().share();  // any thread
  std::size_t next_load_ = 0;

  std::thread thread_;
};

}  // namespace blockwalk
