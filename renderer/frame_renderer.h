// SPDX-License-Identifier: Apache-2.0
// Draws frames: plans, makes resident, and runs the kernel band by band and sample by sample, so that no dispatch is
// long. Of a refinement it draws the samples that are new and adds them to the sums it kept.
#pragma once

#include <chrono>

#include "renderer/band_runner.h"
#include "renderer/find/active_region.h"
#include "renderer/plan/frame_params.h"
#include "renderer/plan/output_values.h"
#include "renderer/plan/transfer_table.h"
#include "renderer/resident/kept_sums.h"
#include "renderer/resident/resident_volume.h"
#include "renderer/resident/visible_cells.h"
#include "renderer/vulkan/kernels.h"

namespace blockwalk {

class FrameRenderer {
 public:
  FrameRenderer(Device& device, const DeviceOptions& options);

  Frame render(VulkanVolume& volume, const FrameOrder& order);
  // Makes resident what the view needs, without drawing.
  void prepare(VulkanVolume& volume, const ResolvedView& view);

 private:
  gpu::FrameParams bindVolume(VulkanVolume& volume, const ResolvedView& view, const Plan& plan);
  void bindRegion(VulkanVolume& volume, ResidentLevel& level, const ResolvedView& view, const Plan& plan,
                  gpu::FrameParams& params);
  void bindTable(const ResolvedView& view, const VulkanVolume& volume, const Plan& plan, const ChannelPlan& drawn,
                 gpu::DrawnChannel& params);
  DeviceTraits traits(const VulkanVolume& volume) const;
  void probeFinders(VulkanVolume& volume, const ResolvedView& view, const FrameOrder& order);
  using Clock = std::chrono::steady_clock;
  // `start`: since when whoever asked for the frame has waited.
  Frame drawPlan(VulkanVolume& volume, const ResolvedView& view, const Plan& plan, const FrameOrder& order,
                 Clock::time_point start);
  // Which samples to draw, and where their sums are: kept for the whole picture, or else a band's alone.
  struct SampleRun {
    int begin = 0;
    int end = 1;
    KeptPicture* kept = nullptr;
    Kernels::Kernel kernel{};
  };
  SampleRun startRun(const VulkanVolume& volume, const ResolvedView& view, const Plan& plan, const FrameOrder& order);
  void finishRun(const SampleRun& run, const ResolvedView& view, const Frame& frame);
  void reserveOutputs(std::size_t pixels, const Plan& plan, const SampleRun& run);
  bool drawSamples(const Plan& plan, const FrameOrder& order, Band band, const SampleRun& run, Frame& frame);
  void drawBands(const Plan& plan, const FrameOrder& order, const OutputValues& values, const SampleRun& run,
                 Frame& frame);
  void draw(VulkanVolume& volume, const ResolvedView& view, const Plan& plan, const FrameOrder& order,
            const OutputValues& values, const SampleRun& run, Frame& frame);

  // What a channel's baked transfer function depends on, and its tables on the device.
  struct TableKey {
    std::uint64_t volume = 0;
    int level = 0;
    StoredRange range;
    std::vector<TransferPoint> transfer;
    TransferShape shape = TransferShape::linear;
    Filter filter = Filter::nearest;
    Mode mode = Mode::blend;
    bool integrals = false;
    bool operator==(const TableKey&) const = default;
  };
  struct BoundTable {
    TableKey key;
    Buffer entries;
    Buffer integrals;
    float scale = 1;
    float first = 0;
    float last = 0;
  };

  Device& device_;
  double band_ms_;
  bool probe_software_;
  Kernels kernels_;
  BandRunner bands_;
  VisibleCells visible_cells_;
  AccelerationStructure unit_box_;
  ActiveRegions regions_;
  FinderBuild finder_build_;  // of the frame at hand
  vk::DescriptorSet instances_;
  Buffer params_;
  Buffer counters_;
  Buffer pixels_;
  Buffer sums_;  // of a band
  KeptSums kept_sums_;
  Buffer probes_;
  std::array<BoundTable, kMaxChannels> tables_;  // by the channel's number in the volume
  double ms_per_pixel_;                          // of the last band, to size the next
};

}  // namespace blockwalk
