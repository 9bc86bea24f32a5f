// SPDX-License-Identifier: Apache-2.0
#include "renderer/renderer.h"

#include <fmt/format.h>

#include "renderer/frame_renderer.h"

namespace blockwalk {
namespace {

// Vulkan's exceptions end here.
class GuardedFrame final : public FrameInProgress {
 public:
  GuardedFrame(const Device& device, std::unique_ptr<FrameInProgress> frame)
      : device_(device), frame_(std::move(frame)) {}
  bool advance() override {
    return device_.calls().translate("a frame", [this] { return frame_->advance(); });
  }
  bool waits() const override { return frame_->waits(); }
  Frame finish() override { return frame_->finish(); }

 private:
  const Device& device_;
  std::unique_ptr<FrameInProgress> frame_;
};

class VulkanRenderer final : public Renderer {
 public:
  explicit VulkanRenderer(const DeviceOptions& options) : device_(options), frames_(device_, options) {
    if (!device_.rayQuery()) {
      device_.note(fmt::format("{}: no ray queries{}; the grid finder serves everything", device_.name(),
                               options.allow_ray_query ? "" : " (hidden)"));
    }
  }

  DeviceInfo device() const override { return device_.info(); }

  std::unique_ptr<ResidentVolume> load(VolumeFile file) override { return frames_.load(std::move(file)); }

  std::unique_ptr<FrameInProgress> begin(ResidentVolume& volume, FrameOrder order) override {
    // Of what load() gave.
    auto& stored = static_cast<VulkanVolume&>(volume);
    return device_.calls().translate(
        "a frame", [&] { return std::make_unique<GuardedFrame>(device_, frames_.begin(stored, std::move(order))); });
  }

  std::vector<PartTotal> parts() const override { return frames_.residency().totals(); }
  void forget(std::uint64_t owner) override { frames_.forget(owner); }

 private:
  Device device_;
  FrameRenderer frames_;
};

}  // namespace

std::unique_ptr<Renderer> createRenderer(const DeviceOptions& options) {
  return std::make_unique<VulkanRenderer>(options);
}

}  // namespace blockwalk
