// SPDX-License-Identifier: Apache-2.0
#include "renderer/frame_renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "renderer/finder_probe.h"
#include "renderer/plan/visible_densities.h"

namespace blockwalk {
namespace {

// Of a pixel on the host: what it holds, a copy that is encoded, and the reply.
constexpr std::size_t kHostPixelBytes = 24;
constexpr std::size_t kMaxBandPixels = std::size_t{1} << 22;

std::uint64_t sum(const gpu::uint (&words)[2]) { return words[0] | std::uint64_t{words[1]} << 32; }

void fillBackground(const ResolvedView& view, Frame& frame) {
  const auto& b = view.background;
  const std::uint32_t pixel =
      b[3] == 0 ? 0 : b[0] | std::uint32_t{b[1]} << 8 | std::uint32_t{b[2]} << 16 | std::uint32_t{b[3]} << 24;
  std::ranges::fill(frame.pixels, pixel);
}

}  // namespace

FrameRenderer::FrameRenderer(Device& device, const DeviceOptions& options)
    : device_(device),
      band_ms_(options.band_ms),
      probe_software_(options.probe_software),
      kernels_(device, options.background_kernels, options.most_kernels),
      bands_(device, kernels_),
      visible_cells_(device),
      regions_(device),
      kept_sums_(device, options.kept_sum_bytes),
      ms_per_pixel_(device.isSoftware() ? 1e-3 : 1e-5) {
  if (device.rayQuery()) unit_box_ = buildUnitBox(device);
  params_ = Buffer(device, sizeof(gpu::FrameParams), BufferUse::upload);
  counters_ = Buffer(device, sizeof(gpu::GpuCounters), BufferUse::readback);
}

void FrameRenderer::reserveOutputs(std::size_t pixels, const Plan& plan, const SampleRun& run) {
  const std::size_t band = std::min(pixels, kMaxBandPixels);
  if (pixels_.bytes() < band * sizeof(std::uint32_t))
    pixels_ = Buffer(device_, band * sizeof(std::uint32_t), BufferUse::readback);
  if (plan.key.antialias != 0 && run.kept == nullptr && sums_.bytes() < band * kSumBytes) {
    sums_ = Buffer(device_, band * kSumBytes, BufferUse::resident);
  }
  if (plan.key.probe != 0 && probes_.bytes() < band * sizeof(gpu::GpuProbe)) {
    probes_ = Buffer(device_, band * sizeof(gpu::GpuProbe), BufferUse::readback);
  }
}

void FrameRenderer::bindTable(const ResolvedView& view, const VulkanVolume& volume, const Plan& plan,
                              const ChannelPlan& drawn, gpu::DrawnChannel& params) {
  BoundTable& bound = tables_[drawn.channel];
  TableKey key{.volume = volume.serial(),
               .level = plan.level,
               .range = drawn.range,
               .transfer = view.channels[drawn.channel].transfer,
               .shape = view.transfer_shape,
               .filter = view.filter,
               .mode = view.mode,
               .integrals = plan.needs_integrals};
  if (bound.key != key) {
    const TransferTable source = bakeTransfer(view, volume.info(), plan, drawn);
    BoundTable table{.key = std::move(key),
                     .entries = uploadVector(device_, source.entries),
                     .integrals = {},
                     .scale = source.scale,
                     .first = source.first,
                     .last = static_cast<float>(source.entries.size() - 1)};
    if (plan.needs_integrals) table.integrals = uploadVector(device_, source.integrals);
    bound = std::move(table);  // all or nothing: memory may have run out above
  }
  params.table = bound.entries.address();
  params.integrals = plan.needs_integrals ? bound.integrals.address() : 0;
  params.table_scale = bound.scale;
  params.table_first = bound.first;
  params.table_last = bound.last;
}

void FrameRenderer::bindRegion(VulkanVolume& volume, ResidentLevel& level, const ResolvedView& view, const Plan& plan,
                               gpu::FrameParams& params) {
  RegionKey key{.volume = volume.serial(),
                .level = plan.level,
                .form = plan.form,
                .apron = plan.needs_apron,
                .cell_voxels = plan.cell_voxels,
                .channels = {}};
  for (const ChannelPlan& drawn : plan.channels) {
    key.channels.push_back({.channel = drawn.channel,
                            .range_mask = drawn.range_mask,
                            .densities = visibleDensities(view, volume.info(), drawn, tables_[drawn.channel].scale)});
  }
  const ActiveRegion& region = plan.needs_clusters ? regions_.clusters(volume, level, std::move(key))
                                                   : regions_.boundary(volume, level, std::move(key));
  params.cell_states = region.states.address();
  params.boxes = plan.needs_clusters ? region.boxes.address() : 0;
  params.cell_dims = region.cell_dims;
  params.cell_voxels = static_cast<float>(plan.cell_voxels);
  finder_build_ = region.build;
  instances_ = kernels_.bindInstances(*region.top.handle);
}

gpu::FrameParams FrameRenderer::bindVolume(VulkanVolume& volume, const ResolvedView& view, const Plan& plan) {
  gpu::FrameParams params = makeFrameParams(view, volume.info(), plan);
  std::vector<std::size_t> channels;
  for (const ChannelPlan& drawn : plan.channels) channels.push_back(drawn.channel);
  ResidentLevel& level = volume.level(plan.level, plan.form, plan.needs_apron, channels);
  for (std::size_t i = 0; i < channels.size(); ++i) {
    ResidentChannel& channel = *level.channels[channels[i]];
    params.channels[i].blocks = channel.blocks.address();
    if (plan.needs_cells) {
      const StoredRange range{.lo = params.channels[i].density_lo, .hi = params.channels[i].density_hi};
      params.channels[i].cells = visible_cells_.find(volume, plan, channel, range).address();
    }
    if (plan.needs_empty) {
      params.channels[i].empty = volume.emptySubblock(channel, channels[i], plan.needs_apron).address();
    }
    if (plan.needs_table) bindTable(view, volume, plan, plan.channels[i], params.channels[i]);
  }
  if (plan.needs_grid) {
    const GridBuffers& grid = volume.grid(level);
    params.grid_tiles = grid.tiles.address();
    params.grid_cells = grid.cells.address();
    params.tile_dims = grid.tile_dims;
  }
  if (plan.needs_octree) {
    const bool blocks = plan.key.mode == gpu::kModeBlocks;
    const OctreeBuffer& octree = volume.octree(level, blocks ? OctreeLeaves::blocks : OctreeLeaves::subblocks);
    params.octree = octree.nodes.address();
    params.octree_depth = octree.depth;
  }
  instances_ = nullptr;
  finder_build_ = {};
  if (plan.needsRegion()) bindRegion(volume, level, view, plan, params);
  if (plan.needs_instances) instances_ = kernels_.bindInstances(*volume.instances(level, unit_box_).handle);
  params.pixels = pixels_.address();
  params.sums = plan.key.antialias != 0 ? sums_.address() : 0;
  params.probes = plan.key.probe != 0 ? probes_.address() : 0;
  params.counters = counters_.address();
  return params;
}

// The band's samples up to the run's end, as many a submission as fit the time of one; false when cancelled.
bool FrameRenderer::drawSamples(const Plan& plan, const FrameOrder& order, Band band, const SampleRun& run,
                                Frame& frame) {
  const int end = run.end;
  const double pixels = static_cast<double>(frame.width) * band.row_count;
  band.sample_count = 1;
  while (band.sample_begin < end) {
    if (order.cancel != nullptr && order.cancel->load(std::memory_order_relaxed)) {
      frame.cancelled = true;
      return false;
    }
    const double ms = bands_.run(run.kernel, plan, frame.width, band, params_.address(), instances_);
    frame.stats.gpu_ms += ms;
    ms_per_pixel_ = std::max(ms, 1e-4) / (pixels * band.sample_count);
    band.sample_begin += band.sample_count;
    const double fitting = std::min(band_ms_ / (ms_per_pixel_ * pixels), 4.0 * band.sample_count);
    band.sample_count = std::clamp(static_cast<int>(fitting), 1, std::max(1, end - band.sample_begin));
  }
  return true;
}

void FrameRenderer::drawBands(const Plan& plan, const FrameOrder& order, const OutputValues& values,
                              const SampleRun& run, Frame& frame) {
  const auto width = static_cast<std::size_t>(frame.width);
  const int most_rows = static_cast<int>(std::max<std::size_t>(1, kMaxBandPixels / width));
  int last_rows = 0;
  for (int row = 0; row < frame.height;) {
    const double fitting = band_ms_ / (ms_per_pixel_ * static_cast<double>(width));
    int rows = static_cast<int>(std::clamp(fitting, 1.0, static_cast<double>(kMaxImageSide)));
    rows = (rows + gpu::kGroupSide - 1) / gpu::kGroupSide * gpu::kGroupSide;
    if (last_rows > 0) rows = std::min(rows, 4 * last_rows);  // a cheap band of sky must not make the next one long
    rows = std::min({rows, most_rows, frame.height - row});
    const std::size_t pixels = width * static_cast<std::size_t>(rows);
    const std::size_t first = width * static_cast<std::size_t>(row);
    if (run.kept != nullptr) {
      // The kernel counts pixels from the band's first. No dispatch is under way that reads this.
      params_.mappedAs<gpu::FrameParams>()[0].sums = run.kept->sums.address() + first * kSumBytes;
    }
    const Band band{.row_begin = row, .row_count = rows, .sample_begin = run.begin};
    if (!drawSamples(plan, order, band, run, frame)) return;
    const auto words = pixels_.mappedAs<std::uint32_t>().first(pixels);
    if (isPicture(frame.output)) {
      std::ranges::copy(words, frame.pixels.begin() + static_cast<std::ptrdiff_t>(first));
    } else {
      values.fromWords(words, row, frame);
    }
    if (order.probe) {
      const auto probes = probes_.mappedAs<gpu::GpuProbe>();
      std::transform(probes.begin(), probes.begin() + static_cast<std::ptrdiff_t>(pixels),
                     frame.probes.begin() + static_cast<std::ptrdiff_t>(first), [](const gpu::GpuProbe& p) {
                       return Probe{.x = p.voxel.x, .y = p.voxel.y, .z = p.voxel.z, .blocks = p.blocks, .t = p.t};
                     });
    }
    last_rows = rows;
    row += rows;
  }
}

DeviceTraits FrameRenderer::traits(const VulkanVolume& volume) const {
  return {.ray_query = device_.rayQuery(),
          .software = device_.isSoftware(),
          .max_instances = device_.maxInstances(),
          .fastest = volume.fastest_finder};
}

// With a small picture of the first view that leaves the finder to us and shows something.
void FrameRenderer::probeFinders(VulkanVolume& volume, const ResolvedView& view, const FrameOrder& order) {
  if (view.finder != Finder::automatic || volume.fastest_finder != Finder::automatic) return;
  if (!device_.rayQuery() || (device_.isSoftware() && !probe_software_)) return;
  ResolvedView small = view;
  small.level = plan(view, volume.info(), traits(volume), false, false).level;
  small.width = std::min(view.width, kProbeSide);
  small.height = std::min(view.height, kProbeSide);
  small.samples = 1;
  const Plan probed = plan(small, volume.info(), traits(volume), false, false);
  const std::uint64_t blocks = volume.info().level(probed.level, probed.form).block_count;
  if (probed.is_blank || blocks > device_.maxInstances()) return;
  const Finder candidates[] = {Finder::query, Finder::grid};
  bool cancelled = false;
  Finder fastest = Finder::grid;
  try {
    fastest = fastestFinder(candidates, kProbeRounds, [&](Finder finder) {
      small.finder = finder;
      Plan tried = plan(small, volume.info(), traits(volume), false, false);
      tried.kernel = KernelWish::specialised;
      const Frame frame = device_.calls().translate("finder auto", [&] {
        return drawPlan(volume, small, tried, {.count = false, .cancel = order.cancel}, Clock::now());
      });
      cancelled = cancelled || frame.cancelled;
      return frame.stats.gpu_ms;
    });
  } catch (const OutOfDeviceMemory& error) {
    // What needs less may still do: the instances take more memory than the grid.
    device_.note(fmt::format("finder auto: query and grid could not be compared ({}); the grid serves", error.what()));
  }
  if (cancelled) return;
  volume.fastest_finder = fastest;
  volume.drop(fastest == Finder::grid ? Finder::query : Finder::grid);
}

void FrameRenderer::prepare(VulkanVolume& volume, const ResolvedView& view) {
  const Plan plan = blockwalk::plan(view, volume.info(), traits(volume), false, false);
  if (!plan.is_blank) bindVolume(volume, view, plan);
}

FrameRenderer::SampleRun FrameRenderer::startRun(const VulkanVolume& volume, const ResolvedView& view, const Plan& plan,
                                                 const FrameOrder& order) {
  if (!order.step) return {.begin = 0, .end = view.samples};
  const SampleStep& step = *order.step;
  BLOCKWALK_CHECK(step.begin, >=, 0);
  BLOCKWALK_CHECK(step.end, >, step.begin);
  BLOCKWALK_CHECK(step.end, <=, view.samples);
  SampleRun run{.begin = 0, .end = step.end};
  if (plan.key.antialias != 0) run.kept = kept_sums_.take(step, volume.serial(), view);
  // Until the step is whole some bands have more samples than others.
  if (run.kept != nullptr) run.begin = std::exchange(run.kept->samples, 0);
  return run;
}

void FrameRenderer::finishRun(const SampleRun& run, const ResolvedView& view, const Frame& frame) {
  if (run.kept == nullptr) return;
  if (frame.cancelled || run.end == view.samples) return kept_sums_.drop(run.kept->owner);
  run.kept->samples = run.end;
  run.kept->counters = counters_.mappedAs<gpu::GpuCounters>()[0];
  run.kept->gpu_ms = frame.stats.gpu_ms;
  run.kept->total_ms = frame.stats.total_ms;
}

void FrameRenderer::draw(VulkanVolume& volume, const ResolvedView& view, const Plan& plan, const FrameOrder& order,
                         const OutputValues& values, const SampleRun& run, Frame& frame) {
  reserveOutputs(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height), plan, run);
  params_.mappedAs<gpu::FrameParams>()[0] = bindVolume(volume, view, plan);
  const auto counters = counters_.mappedAs<gpu::GpuCounters>();
  counters[0] = {};
  RenderStats& stats = frame.stats;
  if (run.begin > 0) {
    counters[0] = run.kept->counters;
    stats.gpu_ms = run.kept->gpu_ms;
    stats.total_ms = run.kept->total_ms;
  }
  frame.samples_drawn = run.end - run.begin;
  stats.finder_build = finder_build_;
  drawBands(plan, order, values, run, frame);
  stats.queries = sum(counters[0].queries);
  stats.block_visits = sum(counters[0].block_visits);
  stats.subblock_visits = sum(counters[0].subblock_visits);
  stats.voxel_steps = sum(counters[0].voxel_steps);
  stats.loop_bound_hits = sum(counters[0].loop_bound_hits);
  stats.non_finite = sum(counters[0].non_finite);
}

Frame FrameRenderer::render(VulkanVolume& volume, const FrameOrder& order) {
  const ResolvedView& view = order.view;
  const auto start = Clock::now();
  probeFinders(volume, view, order);
  Plan plan = blockwalk::plan(view, volume.info(), traits(volume), order.count, order.probe);
  if (order.general || order.specialised) plan.kernel = order.general ? KernelWish::general : KernelWish::specialised;
  return drawPlan(volume, view, plan, order, start);
}

Frame FrameRenderer::drawPlan(VulkanVolume& volume, const ResolvedView& view, const Plan& plan, const FrameOrder& order,
                              Clock::time_point start) {
  const std::size_t pixels = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
  device_.memory().requireOfHost(pixels * kHostPixelBytes, "a picture");
  Frame frame;
  frame.width = view.width;
  frame.height = view.height;
  const OutputValues values(view, volume.info());
  values.prepare(frame);
  if (order.probe) frame.probes.resize(pixels);
  RenderStats& stats = frame.stats;
  stats.rays = pixels * static_cast<std::size_t>(order.step ? order.step->end : view.samples);
  stats.finder = finderName(static_cast<Finder>(plan.key.finder));
  const bool skips = plan.key.finder != gpu::kFinderNone;
  stats.walk = view.walk && skips;
  stats.cull = view.cull && skips;
  stats.level = plan.level;
  stats.kernel = plan.is_blank ? "blank" : describe(plan.key);
  SampleRun run;
  if (plan.is_blank) {
    if (isPicture(view.output)) fillBackground(view, frame);
  } else {
    if (order.rebuild) regions_.forget();
    run = startRun(volume, view, plan, order);
    run.kernel = kernels_.choose(plan.key, plan.kernel);
    if (run.kernel.general) stats.kernel = "general " + stats.kernel;
    draw(volume, view, plan, order, values, run, frame);
  }
  stats.total_ms += std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  finishRun(run, view, frame);
  return frame;
}

}  // namespace blockwalk
