// SPDX-License-Identifier: Apache-2.0
// Sums of samples that stay on the device from one step of a refinement to the next.
//
// Every owner has one picture at most, and the sums of all together take at most a number of bytes: where another
// picture needs the room, the one that was used longest ago gives way and starts over when its next step comes. A
// picture never goes on with what was not its own: its view, its volume and the number of samples must be those that
// the last step left.
#pragma once

#include <cstdint>
#include <list>

#include "renderer/vulkan/buffer.h"
#include "shaders/kernel_interface.h"
#include "view/frame_order.h"

namespace blockwalk {

struct KeptPicture {
  std::uint64_t owner = 0;
  std::uint64_t volume = 0;  // serial number of the volume
  ResolvedView view;
  int samples = 0;  // that the sums hold; 0: they have to be taken anew
  Buffer sums;      // vec4 a pixel of the whole picture, row by row
  // Of all those samples, so that the picture's stats are what they are when it is drawn at once.
  gpu::GpuCounters counters{};
  double gpu_ms = 0;
  double total_ms = 0;
};

class KeptSums {
 public:
  KeptSums(Device& device, std::uint64_t most_bytes) : device_(device), most_bytes_(most_bytes) {}

  // The owner's picture for a step that goes on after `step.begin` samples. Its `samples` are those or 0. Null where
  // the view has more pixels than may be kept. Valid until the next call. Throws DeviceError.
  KeptPicture* take(const SampleStep& step, std::uint64_t volume, const ResolvedView& view);
  // Its memory goes back to the device.
  void drop(std::uint64_t owner);

 private:
  void makeRoom(std::uint64_t bytes);

  Device& device_;
  std::uint64_t most_bytes_;
  std::list<KeptPicture> pictures_;  // the one used last comes first
};

}  // namespace blockwalk
