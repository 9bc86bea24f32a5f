// SPDX-License-Identifier: Apache-2.0
#include "server/render_thread.h"

#include <spdlog/spdlog.h>

namespace blockwalk {

RenderThread::RenderThread(RendererFactory factory, std::vector<std::filesystem::path> files, RenderEvents events)
    : factory_(std::move(factory)), files_(std::move(files)), events_(std::move(events)), volumes_(files_.size()) {
  thread_ = std::thread([this] { run(); });
}

RenderThread::~RenderThread() {
  stop(std::chrono::milliseconds(0));
  thread_.join();
}

void RenderThread::submit(std::uint64_t client, RenderJob job) {
  const std::lock_guard lock(mutex_);
  queue_.add(client, std::move(job));
  wake_.notify_all();
}

bool RenderThread::stop(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  stopping_ = true;
  if (running_cancel_) running_cancel_->store(true);
  wake_.notify_all();
  return wake_.wait_for(lock, patience, [this] { return ended_; });
}

// Loading and rendering take turns, so that a volume that is ready is served while the next one loads.
void RenderThread::run() {
  try {
    renderer_ = factory_();
    events_.on_device(renderer_->device());
  } catch (const std::exception& error) {
    events_.on_no_device(error.what());
  }
  while (renderer_ != nullptr) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [this] { return stopping_ || queue_.size() > 0 || next_load_ < files_.size(); });
    if (stopping_) break;
    auto taken = queue_.take();
    if (taken) running_cancel_ = taken->second.cancel;
    lock.unlock();
    if (taken) renderOne(taken->first, std::move(taken->second));
    if (next_load_ < files_.size()) loadNext();
  }
  volumes_.clear();
  renderer_.reset();
  const std::lock_guard lock(mutex_);
  ended_ = true;
  wake_.notify_all();
}

void RenderThread::loadNext() {
  const std::size_t index = next_load_++;
  try {
    VolumeFile file(files_[index]);
    const LoadedVolume loaded{.info = std::make_shared<const VolumeInfo>(file.info()), .file_bytes = file.fileBytes()};
    volumes_[index] = renderer_->load(std::move(file));
    tellDevice();
    events_.on_loaded(index, loaded);
  } catch (const std::exception& error) {
    spdlog::error("volume not loaded: {}", error.what());
    events_.on_failed(index, error.what());
  }
}

// A frame may have made another level resident.
void RenderThread::tellDevice() {
  DeviceInfo device = renderer_->device();
  if (device.memory_used_bytes == told_used_bytes_) return;
  told_used_bytes_ = device.memory_used_bytes;
  events_.on_device(std::move(device));
}

void RenderThread::renderOne(std::uint64_t client, RenderJob job) {
  RenderResult result;
  const auto begin = std::chrono::steady_clock::now();
  try {
    if (volumes_[job.volume] == nullptr) failData("this volume is not resident");
    result.frame = renderer_->render(*volumes_[job.volume], job.view,
                                     {.count = job.count, .probe = false, .cancel = job.cancel.get()});
    tellDevice();
  } catch (...) {
    result.error = std::current_exception();
  }
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  {
    const std::lock_guard lock(mutex_);
    queue_.charge(client, took.count());
    running_cancel_.reset();
  }
  job.done(std::move(result));
}

}  // namespace blockwalk
