// SPDX-License-Identifier: Apache-2.0
#include "renderer/renderer.h"

#include <fmt/format.h>

#include "renderer/frame_renderer.h"

namespace blockwalk {
namespace {

class VulkanRenderer final : public Renderer {
 public:
  explicit VulkanRenderer(const DeviceOptions& options)
      : device_(options), frames_(device_, options), chunk_bytes_(options.chunk_bytes) {
    if (!device_.rayQuery()) {
      device_.note(fmt::format("{}: no ray queries{}; the grid finder serves everything", device_.name(),
                               options.allow_ray_query ? "" : " (hidden)"));
    }
  }

  // Vulkan's exceptions end here.
  template <typename Work>
  auto guarded(Work&& work) {
    return device_.calls().translate("a frame", work);
  }

  DeviceInfo device() const override { return device_.info(); }

  std::unique_ptr<ResidentVolume> load(VolumeFile file) override {
    return guarded([&] {
      auto volume = std::make_unique<VulkanVolume>(device_, std::move(file), chunk_bytes_);
      frames_.prepare(*volume, resolveView(View{}, volume->info()));
      return volume;
    });
  }

  std::unique_ptr<FrameInProgress> begin(ResidentVolume& volume, FrameOrder order) override {
    return std::make_unique<WholeFrame>(*this, dynamic_cast<VulkanVolume&>(volume), std::move(order));
  }

 private:
  class WholeFrame final : public FrameInProgress {
   public:
    WholeFrame(VulkanRenderer& renderer, VulkanVolume& volume, FrameOrder order)
        : renderer_(renderer), volume_(volume), order_(std::move(order)) {}

    bool advance() override {
      renderer_.guarded([&] {
        if (order_.prepare_only) {
          renderer_.frames_.prepare(volume_, order_.view);
        } else {
          frame_ = renderer_.frames_.render(volume_, order_);
        }
      });
      return false;
    }
    Frame finish() override { return std::move(frame_); }

   private:
    VulkanRenderer& renderer_;
    VulkanVolume& volume_;
    FrameOrder order_;
    Frame frame_;
  };

  Device device_;
  FrameRenderer frames_;
  std::uint64_t chunk_bytes_;
};

}  // namespace

std::unique_ptr<Renderer> createRenderer(const DeviceOptions& options) {
  return std::make_unique<VulkanRenderer>(options);
}

}  // namespace blockwalk
