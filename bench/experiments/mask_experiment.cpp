// SPDX-License-Identifier: Apache-2.0
// How much of a volume eight bits cull: bins that are uniform, as Derin et al. 2021, 2.3 have them, against bins cut at
// quantiles, and both against minimum and maximum and against what is there.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "bench/experiments/experiments.h"
#include "bench/experiments/scene_files.h"
#include "volume/build/statistics.h"

namespace blockwalk::bench {
namespace {

using nlohmann::json;

constexpr int kRangesOfAKind = 10;
constexpr std::uint64_t kSubblocksRead = 4096;

struct StoredDensities {
  float lo = 0;
  float hi = 0;
  bool holds(float density) const { return density >= lo && density <= hi; }
};

// Lower bounds that rise to the end of the data, as one uncovers what is dense, and windows of a tenth of the data.
std::vector<StoredDensities> rangesOf(const ChannelInfo& channel) {
  std::vector<StoredDensities> ranges;
  const float span = channel.density_max - channel.density_min;
  for (int i = 0; i < kRangesOfAKind; ++i) {
    const float lo = channel.density_min + span * static_cast<float>(i) / kRangesOfAKind;
    ranges.push_back({lo, channel.density_max});
    ranges.push_back({lo, lo + span / kRangesOfAKind});
  }
  return ranges;
}

std::uint8_t maskOf(const std::array<float, kRangeMaskBins - 1>& cuts, const StoredDensities& range) {
  std::uint8_t mask = 0;
  for (int bin = rangeMaskBin(cuts, range.lo); bin <= rangeMaskBin(cuts, range.hi); ++bin) mask |= 1u << bin;
  return mask;
}

using Visit = std::function<void(std::span<const std::byte> voxels)>;

// The voxels of every stored subblock of level 0, the first channel.
void forSubblocks(const VolumeFile& file, const Visit& visit) {
  const VolumeInfo& info = file.info();
  const std::size_t bytes = info.subblockVoxels() * voxelBytes(info.type);
  std::vector<std::byte> voxels;
  for (std::uint64_t first = 0; first < info.levels[0].subblock_count; first += kSubblocksRead) {
    const std::uint64_t count = std::min(kSubblocksRead, info.levels[0].subblock_count - first);
    voxels.resize(count * bytes);
    file.readVoxels(0, 0, first, count, voxels);
    for (std::uint64_t i = 0; i < count; ++i) visit(std::span(voxels).subspan(i * bytes, bytes));
  }
}

json measureFile(const VolumeFile& file) {
  const VolumeInfo& info = file.info();
  const ChannelInfo& channel = info.channels[0];
  DensityStatistics statistics(info.type, channel.empty_threshold);
  forSubblocks(file, [&](std::span<const std::byte> voxels) { statistics.add(voxels); });
  ChannelInfo uniform = channel, quantile = channel;
  statistics.describe(uniform, channel.empty_threshold, MaskBins::uniform);
  statistics.describe(quantile, channel.empty_threshold, MaskBins::quantile);

  const std::vector<StoredDensities> ranges = rangesOf(channel);
  struct Counts {
    std::uint64_t uniform = 0, quantile = 0, extent = 0, extent_uniform = 0, extent_quantile = 0, truth = 0;
  };
  std::vector<Counts> culled(ranges.size());
  std::uint64_t subblocks = 0;
  std::vector<float> densities;
  forSubblocks(file, [&](std::span<const std::byte> voxels) {
    densities.clear();
    for (std::size_t at = 0; at < voxels.size(); at += voxelBytes(info.type)) {
      const float density = storedDensity(info.type, &voxels[at]);
      if (!isEmptyDensity(density, channel.empty_threshold)) densities.push_back(density);
    }
    if (densities.empty()) return;  // stored for another channel
    ++subblocks;
    std::ranges::sort(densities);
    std::uint8_t in_uniform = 0, in_quantile = 0;
    for (float density : densities) {
      in_uniform |= 1u << rangeMaskBin(uniform.bin_cuts, density);
      in_quantile |= 1u << rangeMaskBin(quantile.bin_cuts, density);
    }
    for (std::size_t r = 0; r < ranges.size(); ++r) {
      const bool uniform_culls = (in_uniform & maskOf(uniform.bin_cuts, ranges[r])) == 0;
      const bool quantile_culls = (in_quantile & maskOf(quantile.bin_cuts, ranges[r])) == 0;
      const bool extent_culls = densities.front() > ranges[r].hi || densities.back() < ranges[r].lo;
      const auto next = std::ranges::lower_bound(densities, ranges[r].lo);
      culled[r].uniform += uniform_culls ? 1 : 0;
      culled[r].quantile += quantile_culls ? 1 : 0;
      culled[r].extent += extent_culls ? 1 : 0;
      culled[r].extent_uniform += extent_culls || uniform_culls ? 1 : 0;
      culled[r].extent_quantile += extent_culls || quantile_culls ? 1 : 0;
      culled[r].truth += next == densities.end() || !ranges[r].holds(*next) ? 1 : 0;
    }
  });

  const auto share = [&](std::uint64_t count) { return static_cast<double>(count) / static_cast<double>(subblocks); };
  json list = json::array();
  for (std::size_t r = 0; subblocks > 0 && r < ranges.size(); ++r) {
    list.push_back({{"range", {channel.dataFromStored(ranges[r].lo), channel.dataFromStored(ranges[r].hi)}},
                    {"uniform", share(culled[r].uniform)},
                    {"quantile", share(culled[r].quantile)},
                    {"extent", share(culled[r].extent)},
                    {"extent_uniform", share(culled[r].extent_uniform)},
                    {"extent_quantile", share(culled[r].extent_quantile)},
                    {"truth", share(culled[r].truth)}});
  }
  return {{"type", voxelTypeName(info.type)}, {"subblocks", subblocks}, {"ranges", std::move(list)}};
}

}  // namespace

json runMaskExperiment(const ExperimentOptions& options) {
  json result{{"experiment", "masks"}, {"scenes", json::array()}};
  const SceneFiles files(options, {"fossil", "rock", "chip", "vessels", "cells", "smoke"});
  for (const SceneFile& scene : files.all()) {
    if (options.on_step) options.on_step(scene.name);
    json entry = measureFile(VolumeFile(scene.path));
    entry["name"] = scene.name;
    result["scenes"].push_back(std::move(entry));
  }
  return result;
}

}  // namespace blockwalk::bench
