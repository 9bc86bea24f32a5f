// SPDX-License-Identifier: Apache-2.0
// Sums of samples that stay on the device from one step of a refinement to the next.
//
// Every owner has one picture at most. While a frame adds to it the picture is the frame's; what is kept of all
// together takes at most a number of bytes, and gives way as every other part does (renderer/resident/residency.h): the
// owner starts over when his next step comes. A picture never goes on with what was not its own: its view, its volume
// and the number of samples must be those that the last step left.
#pragma once

#include <cstdint>
#include <memory>

#include "renderer/resident/residency.h"
#include "renderer/vulkan/buffer.h"
#include "shaders/kernel_interface.h"
#include "view/frame_order.h"

namespace blockwalk {

struct KeptPicture final : Resident {
  std::uint64_t owner = 0;
  std::uint64_t volume = 0;  // serial number of the volume
  ResolvedView view;
  int samples = 0;  // that the sums hold; 0: they have to be taken anew
  Buffer sums;      // vec4 a pixel of the whole picture, row by row
  // Of all those samples, so that the picture's stats are what they are when it is drawn at once.
  gpu::GpuCounters counters{};
  double gpu_ms = 0;
  double total_ms = 0;

  std::uint64_t bytes() const override { return sums.bytes(); }
};

class KeptSums {
 public:
  KeptSums(Device& device, Residency& residency, std::uint64_t most_bytes)
      : device_(device), residency_(residency), most_bytes_(most_bytes) {}

  // The owner's picture for a step that goes on after `step.begin` samples: his who takes it. Its `samples` are those
  // or 0. Null where the view has more pixels than may be kept. Throws DeviceError.
  std::unique_ptr<KeptPicture> take(const SampleStep& step, std::uint64_t volume, const ResolvedView& view);
  void keep(std::unique_ptr<KeptPicture> picture);
  // Its memory goes back to the device.
  void forget(std::uint64_t owner);

 private:
  Device& device_;
  Residency& residency_;
  std::uint64_t most_bytes_;
};

}  // namespace blockwalk
