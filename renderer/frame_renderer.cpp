// SPDX-License-Identifier: Apache-2.0
#include "renderer/frame_renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace blockwalk {
namespace {

// Milliseconds that a pixel of some view may well take.
constexpr double kSoftwareFloor = 5e-4;
constexpr double kHardwareFloor = 1e-5;

// Of the budget, for the records of one level.
constexpr std::uint64_t kRecordShare = 16;

constexpr Finder kQueryOrGrid[] = {Finder::query, Finder::grid};

}  // namespace

// Of an order: the small pictures that measure the finders, if they are to be measured, and then its own.
class FrameRenderer::OrderedFrame final : public FrameInProgress {
 public:
  OrderedFrame(FrameRenderer& renderer, std::shared_ptr<const VulkanStep> volume, FrameOrder order)
      : renderer_(renderer), shared_(std::move(volume)), volume_(*shared_), order_(std::move(order)) {
    Plan plan = planOf(order_);
    const bool measures = !plan.is_blank && plan.window == BlockWindow{} &&
                          canUse(Finder::grid, volume_.info(), plan.level) &&
                          blocksOf(plan) <= renderer.device_.maxInstances() && renderer.shouldProbe(order_) &&
                          renderer.finders_.beginTrial(volume_.family());
    if (measures) {
      trial_.emplace(kQueryOrGrid, kProbeRounds);
      small_ = {.view = order_.view,
                .count = false,
                .specialised = true,
                .as_it_is = order_.as_it_is,
                .cancel = order_.cancel};
      small_.view.level = plan.level;
      small_.view.width = std::min(order_.view.width, kProbeSide);
      small_.view.height = std::min(order_.view.height, kProbeSide);
      small_.view.samples = 1;
    } else {
      start(std::move(plan));
    }
  }
  ~OrderedFrame() override {
    if (trial_) renderer_.finders_.abandonTrial(volume_.family());
  }
  OrderedFrame(const OrderedFrame&) = delete;
  OrderedFrame& operator=(const OrderedFrame&) = delete;

  bool advance() override {
    if (!trial_) return advanceFrame();
    measure();
    return true;
  }
  bool waits() const override { return probe_ != nullptr ? probe_->waits() : frame_ != nullptr && frame_->waits(); }
  Frame finish() override { return frame_->take(); }

 private:
  std::uint64_t blocksOf(const Plan& plan) const { return volume_.info().level(plan.level, plan.form).block_count; }
  Plan planOf(const FrameOrder& order) const {
    Plan made = plan(order.view, volume_.info(), renderer_.traits(volume_), order.count, order.probe);
    if (order.general || order.specialised) {
      made.kernel = order.general ? KernelWish::general : KernelWish::specialised;
    }
    return made;
  }
  void start(Plan plan) {
    probe_.reset();
    trial_.reset();
    frame_ = std::make_unique<PlannedFrame>(renderer_.tools_, volume_, std::move(plan), order_);
    frame_->tellShortage(renderer_.room_.shortage(volume_.serial()));
  }
  // What finds no room needs less when it is planned anew, or is refused.
  bool advanceFrame() {
    try {
      return frame_->advance();
    } catch (const OutOfDeviceMemory& error) {
      const bool needs_less = frame_->foundNoRoom() && renderer_.room_.giveWay(volume_.serial(), volume_.info(),
                                                                               order_.view, frame_->plan(), error);
      if (!needs_less) throw;
    }
    frame_.reset();
    start(planOf(order_));
    return true;
  }

  // A piece of the trial, with a small picture of the first view that leaves the finder to us and shows something.
  void measure() {
    try {
      if (probe_ == nullptr) {
        small_.view.finder = *trial_->next();
        probe_ = std::make_unique<PlannedFrame>(renderer_.tools_, volume_, planOf(small_), small_);
      }
      if (renderer_.device_.calls().translate("finder auto", [this] { return probe_->advance(); })) return;
      const Frame frame = probe_->take();
      probe_.reset();
      if (frame.cancelled) {
        renderer_.finders_.abandonTrial(volume_.family());
        return start(planOf(order_));  // which ends as this did
      }
      trial_->took(frame.stats.gpu_ms);
      if (trial_->next()) return;
      renderer_.settle(volume_, trial_->fastest());
    } catch (const DeviceLost&) {
      throw;
    } catch (const DeviceError& error) {
      settleForGrid(error.what());
    }
    start(planOf(order_));
  }

  // What needs less may still do: the instances take more memory than the grid.
  void settleForGrid(const char* reason) {
    renderer_.device_.note(
        fmt::format("finder auto: query and grid could not be compared ({}); the grid serves", reason));
    probe_.reset();
    renderer_.settle(volume_, Finder::grid);
  }

  FrameRenderer& renderer_;
  std::shared_ptr<const VulkanStep> shared_;  // else it could give way to other steps meanwhile
  const VulkanStep& volume_;
  FrameOrder order_;
  std::optional<FinderTrial> trial_;
  FrameOrder small_;  // of the trial
  std::unique_ptr<PlannedFrame> probe_;
  std::unique_ptr<PlannedFrame> frame_;
};

FrameRenderer::FrameRenderer(Device& device, const DeviceOptions& options)
    : device_(device),
      probe_software_(options.probe_software),
      parts_(device, options),
      tools_{.device = device,
             .band_ms = options.band_ms,
             .kernels = Kernels(device, options.background_kernels, options.most_kernels),
             .bands = BandRunner(device, tools_.kernels),
             .pages = parts_.pagePool(),
             .residency = Residency([this](const StoredVolume& volume, const Need& need, const Pins& inputs) {
               return parts_.begin(volume, need, inputs);
             }),
             .kept_sums = KeptSums(device, tools_.residency, options.kept_sum_bytes),
             .buffers = FrameBufferPool(device),
             .times = BandTimes(device.isSoftware() ? kSoftwareFloor : kHardwareFloor)},
      room_(options.page_bytes.value_or(device.info().memory_budget_bytes)),
      record_room_(options.record_bytes.value_or(device.info().memory_budget_bytes / kRecordShare)) {
  device.onShortage([this](std::uint64_t bytes) { return reclaim(bytes); });
}

FrameRenderer::~FrameRenderer() { device_.onShortage(nullptr); }

std::unique_ptr<VulkanVolume> FrameRenderer::load(VolumeFile file) {
  return std::make_unique<VulkanVolume>(std::move(file), tools_.residency,
                                        [this](std::uint64_t volume) { forgetVolume(volume); });
}

std::unique_ptr<FrameInProgress> FrameRenderer::begin(VulkanVolume& volume, FrameOrder order) {
  if (room_.hasGivenWay()) room_.reconsider(device_.freeBytes());
  std::shared_ptr<const VulkanStep> step = volume.step(order.view.time);
  return std::make_unique<OrderedFrame>(*this, std::move(step), std::move(order));
}

DeviceTraits FrameRenderer::traits(const VulkanStep& volume) const {
  return {.ray_query = device_.rayQuery(),
          .software = device_.isSoftware(),
          .max_instances = device_.maxInstances(),
          .fastest = finders_.find(volume.family()),
          .page_above_bytes = room_.pageAboveBytes(volume.serial()),
          .page_room_bytes = tools_.pages.mostBytes(),
          .record_room_bytes = record_room_,
          .most_window_cells = room_.mostWindowCells(volume.serial()),
          .finest_level = room_.finestLevel(volume.serial())};
}

bool FrameRenderer::shouldProbe(const FrameOrder& order) const {
  return order.view.finder == Finder::automatic && !order.prepare_only && !order.ahead && device_.rayQuery() &&
         (!device_.isSoftware() || probe_software_);
}

// What the other one looked in goes; it is built again when a view asks for it.
void FrameRenderer::settle(const VulkanStep& volume, Finder fastest) {
  finders_.settle(volume.family(), fastest);
  const Part other = fastest == Finder::grid ? Part::instances : Part::grid;
  tools_.residency.drop(
      [&](std::uint64_t of, const Need& need) { return of == volume.serial() && need.part == other; });
}

std::uint64_t FrameRenderer::reclaim(std::uint64_t bytes) {
  const std::uint64_t before = device_.memory().usedBytes();
  tools_.buffers.drop();
  parts_.dropSpare();
  const std::uint64_t idle = before - device_.memory().usedBytes();
  if (idle >= bytes) return idle;
  const std::uint64_t parts = idle + tools_.residency.evict(bytes - idle);
  return parts >= bytes ? parts : parts + tools_.pages.evict(bytes - parts, {});
}

void FrameRenderer::forgetVolume(std::uint64_t volume) {
  tools_.residency.drop(volume);
  tools_.times.forget(volume);
  finders_.forget(volume);
  room_.forget(volume);
}

}  // namespace blockwalk
