// SPDX-License-Identifier: Apache-2.0
#include "server/render/render_thread.h"

#include <spdlog/spdlog.h>

namespace blockwalk {
namespace {

// Clients learn the file's name, not where it lies.
std::string withoutFolder(std::string text, const std::filesystem::path& file) {
  const std::string path = file.string();
  const std::string name = file.filename().string();
  for (std::size_t at = text.find(path); at != std::string::npos; at = text.find(path, at + name.size())) {
    text.replace(at, path.size(), name);
  }
  return text;
}

}  // namespace

RenderThread::RenderThread(RendererFactory factory, std::vector<std::filesystem::path> files, RenderEvents events)
    : factory_(std::move(factory)),
      files_(std::move(files)),
      events_(std::move(events)),
      volumes_(files_.size()),
      failures_(files_.size()) {
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
    device_.set_value();
  } catch (const std::exception& error) {
    renderer_.reset();
    events_.on_no_device(error.what());
    device_.set_exception(std::current_exception());
  }
  while (renderer_ != nullptr) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [this] { return stopping_ || queue_.size() > 0 || next_load_ < files_.size(); });
    if (stopping_) break;
    auto taken = queue_.take();
    if (taken) running_cancel_ = taken->second.frame.cancel;
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
    fail(index, error.what());
  }
}

// What the device holds of the volume is let go: some of it may not be what the file said.
void RenderThread::fail(std::size_t index, const std::string& reason) {
  spdlog::error("volume failed: {}", reason);
  volumes_[index].reset();
  failures_[index] = withoutFolder(reason, files_[index]);
  events_.on_failed(index, failures_[index]);
}

// A frame may have made another level resident.
void RenderThread::tellDevice() {
  DeviceInfo device = renderer_->device();
  if (device.memory_used_bytes == told_used_bytes_) return;
  told_used_bytes_ = device.memory_used_bytes;
  events_.on_device(std::move(device));
}

// A file that broke while it is served ends its volume; whatever else goes wrong is this frame's alone.
RenderResult RenderThread::renderFrame(const RenderJob& job) {
  RenderResult result;
  try {
    if (volumes_[job.volume] == nullptr) throw VolumeError(failures_[job.volume]);
    result.frame = renderer_->render(*volumes_[job.volume], job.frame);
    tellDevice();
  } catch (const ViewError&) {
    result.error = std::current_exception();
  } catch (const VolumeError&) {
    result.error = std::current_exception();
  } catch (const DataError& broken) {
    fail(job.volume, broken.what());
    tellDevice();
    result.error = std::make_exception_ptr(VolumeError(failures_[job.volume]));
  } catch (...) {
    result.error = std::current_exception();
  }
  return result;
}

void RenderThread::renderOne(std::uint64_t client, RenderJob job) {
  const auto begin = std::chrono::steady_clock::now();
  RenderResult result = renderFrame(job);
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  {
    const std::lock_guard lock(mutex_);
    queue_.charge(client, took.count());
    running_cancel_.reset();
  }
  result.took_ms = took.count();
  job.done(std::move(result));
}

}  // namespace blockwalk
