// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace blockwalk {

// Where a device may fail, and how: for tests (renderer/vulkan/device_calls.h).
enum class DeviceCall : std::uint8_t { allocate, create, compile, submit, wait };
enum class DeviceFault : std::uint8_t { none, out_of_memory, lost };

struct DeviceOptions {
  std::string device;           // part of a name, or an index; empty: discrete, else integrated, else software
  bool allow_ray_query = true;  // false hides ray queries, so that `grid` serves everything
  bool validation = false;      // Khronos validation with synchronisation validation; messages go to `on_message`
  std::uint64_t chunk_bytes = std::uint64_t{256} << 20;  // one allocation of voxels; lowered to what the device allows
  // Boxes or triangles of one acceleration structure; lowered to what the device allows.
  std::uint64_t max_primitives = ~std::uint64_t{0};
  // What this renderer may hold on the device, all together; 0: as much as the device says it has.
  std::uint64_t memory_budget_bytes = 0;
  // Voxels of a level that take more come and go block by block, and take no more together (docs/large.md). None: what
  // finds no room as a whole comes and goes, and takes five eighths of the budget. 0: all of a level are there, or the
  // view is refused.
  std::optional<std::uint64_t> page_bytes{};
  // Records of a level of which voxels come and go that take more are read by windows of what a view can come to. None:
  // a sixteenth of the budget. 0: all of a level are there, or a coarser one is drawn.
  std::optional<std::uint64_t> record_bytes{};
  std::uint64_t piece_macrocells = std::uint64_t{1} << 20;  // looked at in one submission
  // Measure what the finder `auto` means on a software device too. Elsewhere it is measured for every volume. On
  // lavapipe a kernel that is tried takes about half a second to compile, and none was found that beats the grid by
  // much (docs/experiments).
  bool probe_software = false;
  // Draw with a general kernel while a view's own is made on a thread of its own (renderer/vulkan/kernels.h): for many
  // who share the device. Else a view waits for its kernel.
  bool background_kernels = false;
  std::size_t most_kernels = 64;  // kept, some 3 MB each on lavapipe
  double band_ms = 25;            // frames are cut into bands of about this device time
  // Of sums that refinements keep between their steps, all together (renderer/resident/kept_sums.h).
  std::uint64_t kept_sum_bytes = std::uint64_t{256} << 20;
  // A submission that takes longer hangs, and the device is lost; by default 20 s, on a software device 300 s.
  std::optional<std::chrono::milliseconds> longest_wait{};
  // Asked before each call how it should fail. Null: not at all.
  std::function<DeviceFault(DeviceCall)> inject_fault{};
  std::function<void(const std::string&)> on_message;  // validation messages and one-time notes
};

}  // namespace blockwalk
