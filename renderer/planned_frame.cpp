// SPDX-License-Identifier: Apache-2.0
#include "renderer/planned_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string_view>
#include <utility>

#include "renderer/plan/paging.h"
#include "view/reasons.h"

namespace blockwalk {
namespace {

// Of a pixel on the host: what it holds, a copy that is encoded, and the reply.
constexpr std::size_t kHostPixelBytes = 24;

std::uint64_t sum(const gpu::uint (&words)[2]) { return words[0] | std::uint64_t{words[1]} << 32; }

Probe probeOf(const gpu::GpuProbe& p) {
  return {.x = p.voxel.x, .y = p.voxel.y, .z = p.voxel.z, .blocks = p.blocks, .t = p.t};
}

bool isRegion(Part part) { return part == Part::clusters || part == Part::boundary; }

OutOfDeviceMemory withAdvice(const OutOfDeviceMemory& error, std::string_view field, std::string_view advice) {
  return {fmt::format("{}; {}", error.what(), advice), error.needed_bytes, error.free_bytes, std::string(field)};
}

}  // namespace

PlannedFrame::PlannedFrame(FrameTools& tools, const VulkanStep& volume, Plan plan, const FrameOrder& order)
    : tools_(tools),
      volume_(volume),
      order_(order),
      plan_(std::move(plan)),
      values_(order.view, volume.info(), plan_.level),
      sample_end_(order.step ? order.step->end : order.view.samples),
      asker_(tools.pages.nextAsker()) {
  describe();
  if (order.rebuild) {
    tools.residency.drop(
        [serial = volume.serial()](std::uint64_t of, const Need& need) { return of == serial && isRegion(need.part); });
  }
}

PlannedFrame::~PlannedFrame() { end(); }

void PlannedFrame::hold() {
  shortage_ = nullptr;
  if (!std::exchange(holds_, true)) ++tools_.under_way.holding;
}

void PlannedFrame::letGo() noexcept {
  if (std::exchange(is_begun_, false)) tools_.buffers.give(std::exchange(buffers_, {}));
  kept_.reset();
  holdPages(std::nullopt);
  for (const PagedPart& part : bound_.paged) part.voxels->forget(asker_);
  bound_.paged.clear();
  awaits_turn_ = false;
  part_.reset();
  brings_pages_ = is_short_ = false;
  rows_ahead_ = looks_ = 0;
  begun_moment_ = ahead_moment_ = 0;
  waits_for_.reset();
  pins_.clear();
  if (std::exchange(holds_, false)) --tools_.under_way.holding;
}

void PlannedFrame::end() noexcept {
  if (holds_) ++tools_.under_way.ended;
  letGo();
}

bool PlannedFrame::waits() const {
  if (awaits_turn_) return !tools_.pages.hasTurn(asker_);
  return shortage_ != nullptr && tools_.under_way.holding > 0 && tools_.under_way.ended == ended_before_;
}

void PlannedFrame::defer(std::exception_ptr shortage) {
  shortage_ = std::move(shortage);
  // No sample was drawn: the sums are as the last step left them.
  if (kept_ != nullptr && kept_->samples > 0) tools_.kept_sums.keep(std::move(kept_));
  letGo();
  frame_.pixels = {};
  frame_.values = {};
  frame_.probes = {};
  next_need_ = 0;
  sample_begin_ = 0;
  ended_before_ = tools_.under_way.ended;
}

void PlannedFrame::describe() {
  const ResolvedView& view = order_.view;
  frame_.width = order_.pixel ? 1 : view.width;
  frame_.height = order_.pixel ? 1 : view.height;
  RenderStats& stats = frame_.stats;
  stats.rays = framePixels() * static_cast<std::size_t>(sample_end_);
  stats.finder = finderName(static_cast<Finder>(plan_.key.finder));
  const bool skips = plan_.key.finder != gpu::kFinderNone;
  stats.walk = view.walk && skips;
  stats.cull = view.cull && skips;
  stats.level = plan_.level;
  stats.far_level = plan_.is_blank ? plan_.level : plan_.farLevel();
  stats.paged = plan_.isPaged();
  stats.is_coarser = plan_.is_coarser;
  stats.as_it_is = order_.as_it_is;
  stats.kernel = plan_.is_blank ? "blank" : blockwalk::describe(plan_.key);
}

bool PlannedFrame::advance() {
  const auto start = std::chrono::steady_clock::now();
  bool more = false;
  if (isCancelled()) {
    frame_.cancelled = true;
  } else {
    if (shortage_ != nullptr && waits()) std::rethrow_exception(shortage_);
    hold();
    try {
      more = advanceWork();
    } catch (const OutOfDeviceMemory& error) {
      if (order_.ahead) {
        finish();
        return false;
      }
      const bool draws = cutter_.has_value();  // and takes nothing more
      const bool fits_alone = error.needed_bytes <= tools_.device.info().memory_budget_bytes;
      const OutOfDeviceMemory advised = advise(error);
      found_no_room_ = !draws && isMaking();
      if (draws || !fits_alone || tools_.under_way.holding == 1) throw advised;
      found_no_room_ = false;
      defer(std::make_exception_ptr(advised));
      more = true;
    }
  }
  frame_.stats.total_ms += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  if (!more) finish();
  return more;
}

// With the member of the view of which another value needs less of what was short.
OutOfDeviceMemory PlannedFrame::advise(const OutOfDeviceMemory& error) const {
  if (order_.prepare_only) return error;
  if (isMaking()) {
    const bool is_coarsest = static_cast<std::size_t>(plan_.level) + 1 >= volume_.info().levels.size();
    if (!is_coarsest) return withAdvice(error, "level", "a coarser level needs less");
    const bool has_apron_for_filter =
        plan_.key.filter == static_cast<std::uint32_t>(Filter::linear) && plan_.key.lit == 0;
    if (has_apron_for_filter) return withAdvice(error, "filter", "filter nearest needs less");
    return error;
  }
  if (!is_begun_) return withAdvice(error, "size", "a smaller picture needs less");
  return error;
}

bool PlannedFrame::advanceWork() {
  if (order_.ahead && !isResident()) return false;
  if (!makeResident()) return true;
  if (order_.prepare_only) return false;
  if (!is_begun_) begin();
  if (plan_.is_blank) return false;
  if (order_.ahead) return bringAhead();
  // Who is not let wait any longer has what is there.
  if (awaits_turn_) is_short_ = !tools_.pages.hasTurn(asker_);
  awaits_turn_ = false;
  if (brings_pages_ && bringPages()) return true;
  if (looksAhead()) {
    lookAhead();
    return true;
  }
  if (bound_.paged.empty()) {
    drawOne();
  } else {
    drawPaged();
  }
  return !cutter_->isDone();
}

// All that it needs but voxels that come and go.
bool PlannedFrame::isResident() {
  return std::ranges::all_of(
      plan_.needs, [this](const Need& need) { return tools_.residency.find(volume_.serial(), need) != nullptr; });
}

// What is there is taken at once; of what is not, one piece a call. True once all is there.
bool PlannedFrame::makeResident() {
  for (bool worked = false; next_need_ < plan_.needs.size(); ++next_need_) {
    const Need& need = plan_.needs[next_need_];
    std::shared_ptr<const Slot> slot = tools_.residency.find(volume_.serial(), need);
    if (slot == nullptr) {
      if (worked) return false;
      worked = true;
      waits_for_ = tools_.residency.advance(volume_.stored(), need, pins_);
      if (waits_for_->resident == nullptr) return false;
      slot = std::move(waits_for_);
      made_region_ = made_region_ || isRegion(need.part);
    }
    waits_for_.reset();
    pins_.add(need, std::move(slot));
  }
  return true;
}

void PlannedFrame::begin() {
  const ResolvedView& view = order_.view;
  const std::size_t pixels =
      static_cast<std::size_t>(view.width) * static_cast<std::size_t>(order_.pixel ? 1 : view.height);
  tools_.device.memory().requireOfHost(pixels * kHostPixelBytes, "a picture");
  if (plan_.is_blank) {
    values_.prepare(frame_);
    if (order_.probe) frame_.probes.resize(framePixels());
    return;
  }
  takeSums();
  const bool sums = plan_.key.antialias != 0 && kept_ == nullptr;
  bound_ = bind(view, volume_.info(), plan_, pins_);
  for (const PagedPart& part : bound_.paged) {
    if (!order_.as_it_is && !order_.ahead) part.voxels->tryAgain();  // views that move would ask for ever
  }
  if (order_.as_it_is) bringInWhatIsRead();
  bound_.data.params.requests = static_cast<std::uint32_t>(view.requests);
  bound_.data.params.rank_words = order_.as_it_is && view.requests != Requests::file ? bound_.wanted_words : 0;
  buffers_ = tools_.buffers.take({.pixels = std::min(pixels, kMaxBandPixels),
                                  .sums = sums,
                                  .probes = plan_.key.probe != 0,
                                  .wanted_words = bound_.wanted_words * (hasRanks() ? gpu::kRequestRanks : 1)});
  is_begun_ = true;
  kernel_ = tools_.kernels.choose(plan_.key, plan_.kernel);
  if (kernel_.general) frame_.stats.kernel = "general " + frame_.stats.kernel;
  values_.prepare(frame_);
  if (order_.probe) frame_.probes.resize(framePixels());
  bound_.build.rebuilt = made_region_;
  bound_.data.params.pixels = buffers_.pixels.address();
  bound_.data.params.sums = sums ? buffers_.sums.address() : 0;
  bound_.data.params.probes = plan_.key.probe != 0 ? buffers_.probes.address() : 0;
  bound_.data.params.counters = buffers_.counters.address();
  bound_.data.params.wanted = bound_.paged.empty() ? 0 : buffers_.wanted.address();
  bound_.data.params.next_samples = bound_.paged.empty() ? 0 : buffers_.next_samples.address();
  buffers_.params.mappedAs<gpu::FrameData>()[0] = bound_.data;
  buffers_.counters.mappedAs<gpu::GpuCounters>()[0] = {};
  if (sample_begin_ > 0) {
    buffers_.counters.mappedAs<gpu::GpuCounters>()[0] = kept_->counters;
    frame_.stats.gpu_ms = kept_->gpu_ms;
    frame_.stats.total_ms += kept_->total_ms;
  }
  frame_.samples_drawn = sample_end_ - sample_begin_;
  frame_.stats.finder_build = bound_.build;
  const glm::ivec2 begin =
      order_.pixel ? glm::ivec2(order_.pixel->x / gpu::kGroupSide * gpu::kGroupSide, order_.pixel->y) : glm::ivec2(0);
  const glm::ivec2 end = order_.pixel
                             ? glm::min(begin + glm::ivec2(gpu::kGroupSide, 1), glm::ivec2(view.width, view.height))
                             : glm::ivec2(view.width, view.height);
  cutter_.emplace(BandLimits{.width = end.x,
                             .height = end.y,
                             .column_begin = begin.x,
                             .row_begin = begin.y,
                             .sample_begin = sample_begin_,
                             .sample_end = sample_end_,
                             .band_ms = tools_.band_ms,
                             .ms_per_pixel = tools_.times.find(volume_.serial(), plan_.level, plan_.key)});
}

// Which samples are to be drawn, and where their sums are: kept for the whole picture, or else a band's alone.
void PlannedFrame::takeSums() {
  if (!order_.step) return;
  const SampleStep& step = *order_.step;
  BLOCKWALK_CHECK(step.begin, >=, 0);
  BLOCKWALK_CHECK(step.end, >, step.begin);
  BLOCKWALK_CHECK(step.end, <=, order_.view.samples);
  if (plan_.key.antialias == 0) return;
  kept_ = tools_.kept_sums.take(step, volume_.serial(), order_.view);
  if (kept_ != nullptr) sample_begin_ = kept_->samples;
}

void PlannedFrame::drawOne() {
  const Band band = cutter_->next();
  if (kept_ != nullptr) {
    // The kernel counts pixels from the band's first. No dispatch is under way that reads this.
    buffers_.params.mappedAs<gpu::FrameData>()[0].params.sums = kept_->sums.address() + sumBytes(band.row_begin);
  }
  const vk::DescriptorSet set = bound_.instances.empty() ? nullptr : tools_.kernels.bindInstances(bound_.instances);
  const double ms = tools_.bands.run(kernel_, plan_, band, buffers_.params.address(), set);
  frame_.stats.gpu_ms += ms;
  if (cutter_->ran(ms)) readBand(band);
}

// Where the pixel lies in the buffers, of which the band has a row.
void PlannedFrame::readPixel() {
  const auto at = static_cast<std::size_t>(order_.pixel->x);
  if (order_.probe) frame_.probes[0] = probeOf(buffers_.probes.mappedAs<gpu::GpuProbe>()[at]);
  const auto level_at = [this](double depth) {
    int level = plan_.level;
    for (std::size_t far = 0; far < plan_.farCount(); ++far) {
      if (depth >= plan_.coarse[far].depth) level = plan_.coarse[far].level;
    }
    return level;
  };
  values_.fromWord(buffers_.pixels.mappedAs<std::uint32_t>()[at], *order_.pixel, level_at,
                   order_.probe ? frame_.probes[0] : Probe{}, frame_);
}

void PlannedFrame::readBand(const Band& band) {
  if (order_.pixel) {
    readPixel();
    return;
  }
  const auto width = static_cast<std::size_t>(frame_.width);
  const std::size_t pixels = width * static_cast<std::size_t>(band.row_count);
  const auto first = static_cast<std::ptrdiff_t>(width * static_cast<std::size_t>(band.row_begin));
  const auto words = buffers_.pixels.mappedAs<std::uint32_t>().first(pixels);
  if (isPicture(frame_.output)) {
    std::ranges::copy(words, frame_.pixels.begin() + first);
  } else {
    values_.fromWords(words, band.row_begin, frame_);
  }
  if (!order_.probe) return;
  const auto probes = buffers_.probes.mappedAs<gpu::GpuProbe>().first(pixels);
  std::ranges::transform(probes, frame_.probes.begin() + first, probeOf);
}

void PlannedFrame::finish() {
  // A few pixels take long for what they are.
  if (cutter_ && !frame_.cancelled && !order_.pixel && !order_.ahead) {
    tools_.times.note(volume_.serial(), plan_.level, plan_.key, cutter_->expectedMsPerPixel());
  }
  if (is_begun_) {
    const gpu::GpuCounters& counters = buffers_.counters.mappedAs<gpu::GpuCounters>()[0];
    RenderStats& stats = frame_.stats;
    stats.queries = sum(counters.queries);
    stats.block_visits = sum(counters.block_visits);
    stats.subblock_visits = sum(counters.subblock_visits);
    stats.voxel_steps = sum(counters.voxel_steps);
    stats.loop_bound_hits = sum(counters.loop_bound_hits);
    stats.non_finite = sum(counters.non_finite);
    // Until a step is whole some bands have more samples than others: what is cancelled is not kept.
    // What some samples were shown coarser is not what the next ones are added to.
    const bool is_exact = !frame_.cancelled && stats.absent_blocks == 0;
    if (kept_ != nullptr && is_exact && sample_end_ < order_.view.samples) {
      kept_->samples = sample_end_;
      kept_->counters = counters;
      kept_->gpu_ms = stats.gpu_ms;
      kept_->total_ms = stats.total_ms;
      tools_.kept_sums.keep(std::move(kept_));
    }
  }
  if (!frame_.cancelled && !order_.prepare_only && !order_.ahead) judge();
  end();
}

// What the picture shows, and if that is nothing or coarser than it was to be, why.
void PlannedFrame::judge() {
  RenderStats& stats = frame_.stats;
  stats.drawn_pixels = values_.countDrawn(frame_);
  if (stats.is_coarser) {
    stats.needed_bytes = shortage_bytes_.needed;
    stats.room_bytes = shortage_bytes_.free;
  } else if (stats.absent_blocks > 0 && !stats.as_it_is) {
    stats.needed_bytes = voxelBytes(volume_.info(), plan_);
    stats.room_bytes = tools_.pages.mostBytes();
  }
  stats.reasons = reasonsOf(order_.view, volume_.info(), stats);
}

}  // namespace blockwalk
