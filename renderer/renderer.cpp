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
      device_.note(fmt::format("{}: no ray queries{}; the grid finder serves everything", device_.info().name,
                               options.allow_ray_query ? "" : " (hidden)"));
    }
  }

  // Vulkan's exceptions end here.
  template <typename Work>
  auto guarded(Work&& work) {
    try {
      return work();
    } catch (const vk::SystemError& error) {
      throw DeviceError(fmt::format("{}: {}", device_.info().name, error.what()));
    }
  }

  DeviceInfo device() const override { return device_.info(); }

  std::unique_ptr<ResidentVolume> load(VolumeFile file) override {
    return guarded([&] {
      auto volume = std::make_unique<VulkanVolume>(device_, std::move(file), chunk_bytes_);
      frames_.prepare(*volume, resolveView(View{}, volume->info()));
      return volume;
    });
  }

  Frame render(ResidentVolume& volume, const View& view, const RenderOptions& options) override {
    return guarded(
        [&] { return frames_.render(dynamic_cast<VulkanVolume&>(volume), resolveView(view, volume.info()), options); });
  }

 private:
  Device device_;
  FrameRenderer frames_;
  std::uint64_t chunk_bytes_;
};

}  // namespace

std::unique_ptr<Renderer> createRenderer(const DeviceOptions& options) {
  return std::make_unique<VulkanRenderer>(options);
}

}  // namespace blockwalk
