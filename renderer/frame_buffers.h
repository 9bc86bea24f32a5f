// SPDX-License-Identifier: Apache-2.0
// What the kernel writes of a frame under way, and the frame's own numbers. A frame has its own as long as it is drawn;
// after that the next takes them.
#pragma once

#include <cstddef>
#include <list>

#include "renderer/vulkan/buffer.h"

namespace blockwalk {

struct FrameBuffers {
  Buffer params;    // gpu::FrameData
  Buffer counters;  // gpu::GpuCounters
  Buffer pixels;    // of a band
  Buffer sums;
  Buffer probes;
  Buffer wanted;        // uint[]: a bit for each block of the paged levels that a ray came to
  Buffer next_samples;  // uint[], of a band there: the sample that comes next of each pixel
};

class FrameBufferPool {
 public:
  struct Sizes {
    std::size_t pixels = 0;  // of a band
    bool sums = false;
    bool probes = false;
    std::uint64_t wanted_words = 0;  // where voxels come and go
  };

  explicit FrameBufferPool(Device& device) : device_(device) {}

  // At least so large. Throws DeviceError.
  FrameBuffers take(const Sizes& sizes);
  void give(FrameBuffers buffers) noexcept;
  // Lets go of all that no frame has.
  void drop() { idle_.clear(); }

 private:
  Device& device_;
  std::list<FrameBuffers> idle_;  // the last given back comes first
};

}  // namespace blockwalk
