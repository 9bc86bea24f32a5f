// SPDX-License-Identifier: Apache-2.0
#include "volume/build/builder.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <optional>
#include <system_error>
#include <utility>

#include "volume/build/build_into.h"
#include "volume/build/levels.h"
#include "volume/build/scan.h"
#include "volume/build/workers.h"
#include "volume/build/write.h"
#include "volume/error.h"
#include "volume/host_limits.h"
#include "volume/plain_text.h"

namespace blockwalk {
namespace {

constexpr std::size_t kFewValues = 16;

void checkChannels(const SourceInfo& source) {
  const std::size_t count = source.channels.size();
  if (count < 1 || count > kMaxChannels || (count > 1 && source.type == VoxelType::rgba8)) {
    failData("{}: {} channels of {}, must be 1..{}, of rgba8 1", source.name, count, voxelTypeName(source.type),
             kMaxChannels);
  }
  for (const SourceChannel& channel : source.channels) {
    if (!std::isfinite(channel.value_scale) || channel.value_scale <= 0 || !std::isfinite(channel.value_offset)) {
      failData("{}: value map scale {} offset {}, must be finite and the scale above 0", source.name,
               channel.value_scale, channel.value_offset);
    }
    if (!std::isfinite(static_cast<float>(channel.value_offset / channel.value_scale))) {
      failData("{}: value offset {} over scale {} is beyond a float", source.name, channel.value_offset,
               channel.value_scale);
    }
    if (plainText(channel.name).size() > kMaxChannelNameBytes) {
      failData("{}: channel name '{}' has {} bytes, must be at most {}", source.name, channel.name, channel.name.size(),
               kMaxChannelNameBytes);
    }
  }
  if (count == 1 && !source.channels[0].name.empty()) {
    failData("{}: channel name '{}': a single channel has no name", source.name, source.channels[0].name);
  }
}

void checkSource(const SourceInfo& source) {
  for (int axis = 0; axis < 3; ++axis) {
    if (source.dims[axis] < 1 || source.dims[axis] > kMaxDim) {
      failData("{}: {} voxels on axis {}, must be 1..{}", source.name, source.dims[axis], axis, kMaxDim);
    }
  }
  if (voxelBytes(source.type) == 0) failData("{}: unknown voxel type", source.name);
  checkChannels(source);
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 4; ++row) {
      if (!std::isfinite(source.world_from_index[column][row])) {
        failData("{}: the map from voxels to the world is not finite", source.name);
      }
    }
  }
  const double determinant = glm::determinant(glm::dmat3(source.world_from_index));
  if (!std::isfinite(determinant) || !std::isfinite(1 / determinant)) {
    failData("{}: the map from voxels to the world has determinant {}, must be finite and not 0", source.name,
             determinant);
  }
  if (plainText(source.name).size() > kMaxNameBytes) {
    failData("{}: the name has {} bytes, must be at most {}", source.name, source.name.size(), kMaxNameBytes);
  }
}

void checkOptions(const BuildOptions& options, const VolumeInfo& info) {
  if (options.subblock_side != 4 && options.subblock_side != 8 && options.subblock_side != 16) {
    failData("subblock side is {}, must be 4, 8 or 16", options.subblock_side);
  }
  if (options.block_side < 1 || options.block_side > kMaxBlockSide) {
    failData("block side is {}, must be 1..{}", options.block_side, kMaxBlockSide);
  }
  const std::size_t thresholds = options.empty_thresholds.size();
  if (thresholds > 1 && thresholds != info.channels.size()) {
    failData("{} empty thresholds are given, must be 1 or {}, one a channel", thresholds, info.channels.size());
  }
  for (const double threshold : options.empty_thresholds) {
    if (!std::isfinite(threshold)) failData("empty threshold is {}, must be finite", threshold);
  }
  if (options.values == ValuesRule::labels && info.type == VoxelType::rgba8) {
    failData("{}: values: colours (rgba8) are no labels", info.metadata.source_name);
  }
  if (options.memory_bytes < kLeastMemoryBytes) {
    failData("memory is {} bytes, must be at least {}", options.memory_bytes, kLeastMemoryBytes);
  }
  const std::uint64_t least = leastMemoryBytes(info);
  if (options.memory_bytes < least) {
    failData("{}: memory is {} bytes, must be at least {} for a volume this wide with these sides",
             info.metadata.source_name, options.memory_bytes, least);
  }
}

// What is known before a voxel is read.
VolumeInfo describeSource(const SourceInfo& source, const BuildOptions& options) {
  VolumeInfo info;
  info.type = source.type;
  info.dims = source.dims;
  info.subblock_side = options.subblock_side;
  info.block_side = options.block_side;
  info.world_from_index = source.world_from_index;
  info.channels.resize(source.channels.size());
  for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
    info.channels[channel].name = plainText(source.channels[channel].name);
    info.channels[channel].unit = plainText(source.channels[channel].unit);
    if (source.type != VoxelType::rgba8) info.channels[channel].color = source.channels[channel].color;
    info.channels[channel].window = source.channels[channel].window;
    info.channels[channel].labels = source.channels[channel].labels;
    info.channels[channel].value_scale = source.channels[channel].value_scale;
    info.channels[channel].value_offset = source.channels[channel].value_offset;
    if (source.channels[channel].is_labels) info.channels[channel].values = ChannelValues::labels;
  }
  info.metadata.source_name = plainText(source.name);
  info.metadata.source_kind = source.format;
  info.metadata.length_unit = plainText(source.length_unit);
  info.metadata.space = plainText(source.space);
  for (const auto& [key, value] : source.facts) info.metadata.others.emplace_back(key, plainText(value));
  return info;
}

VolumeInfo checkedGrid(const SourceInfo& source, const BuildOptions& options) {
  checkSource(source);
  VolumeInfo grid = describeSource(source, options);
  checkOptions(options, grid);
  return grid;
}

// And what the densities are, once all were read.
VolumeInfo describeScanned(VolumeInfo info, const Scan& scan, const BuildOptions& options,
                           std::vector<std::size_t>& guessed_otherwise) {
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    ChannelInfo& channel = info.channels[i];
    scan.statistics[i].describe(channel, scan.thresholds[i], options.mask_bins);
    if (options.values == ValuesRule::labels) channel.values = ChannelValues::labels;
    // What the source says need not be guessed.
    if (options.values == ValuesRule::intensity) channel.values = ChannelValues::intensity;
    if (options.values == ValuesRule::guess && channel.values != ChannelValues::labels) {
      channel.values = scan.guesses[i].guess(scan.statistics[i].distinctAbove(channel.empty_threshold));
    }
    if (!options.channel_values.empty() && options.channel_values.at(i) != channel.values) {
      // Few values are nobody's amounts and may be anybody's labels.
      const bool is_sure = channel.values == ChannelValues::labels ||
                           scan.statistics[i].distinctAbove(channel.empty_threshold) > kFewValues;
      if (options.values == ValuesRule::guess && is_sure) guessed_otherwise.push_back(i);
      channel.values = options.channel_values[i];
    }
    if (channel.values == ChannelValues::labels && options.mask_bins == MaskBins::automatic) {
      scan.statistics[i].describe(channel, scan.thresholds[i], MaskBins::quantile);
    }
    const ConversionReport& conversion = scan.conversions[i];
    // A source that converts may have lost the NaN that it counted, and one that does not may not have counted.
    channel.nonfinite_voxels = std::max(channel.nonfinite_voxels, conversion.nonfinite_voxels);
    channel.largest_rounding = conversion.largest_rounding;
  }
  return info;
}

// And what the levels hold: whole.
VolumeInfo describeBuilt(VolumeInfo info, const BuiltLevels& built) {
  for (const BuiltLevel& level : built.levels) info.levels.push_back(level.info);
  for (const BuiltLevel& level : built.maxima) info.maxima.push_back(level.info);
  for (std::size_t i = 0; i < built.counts.size(); ++i) {
    info.channels[i].nonempty_voxels = built.counts[i].nonempty_voxels;
    info.channels[i].histogram = built.counts[i].histogram;
  }
  return info;
}

// Said before hours of reading, not after.
void checkPath(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) {
    throw std::system_error(EISDIR, std::generic_category(), path.string());
  }
  const std::filesystem::path folder = folderOf(path);
  if (!std::filesystem::is_directory(folder)) {
    throw std::system_error(ENOENT, std::generic_category(), folder.string());
  }
}

}  // namespace

BuildReport buildVolume(Source& source, const std::filesystem::path& path, const BuildOptions& options) {
  return buildVolume(source, path, options, budgetFor(source, options));
}

BuildReport buildVolume(Source& source, const std::filesystem::path& path, const BuildOptions& options,
                        const BuildBudget& budget) {
  std::optional<OutputFile> file;
  BuildReport report = buildInto(source, path, options, budget,
                                 [&]() -> WritePlace { return {.file = file.emplace(path), .begin = 0}; });
  if (options.accept) options.accept(file->partialPath());
  file->commit();
  report.leftovers = file->leftovers();
  return report;
}

BuildBudget budgetFor(const Source& source, const BuildOptions& options) {
  const VolumeInfo grid = checkedGrid(source.info(), options);
  return budgetOf(grid, source.info().random_access, options.memory_bytes, hostProcessors().to_use);
}

BuildReport buildInto(Source& source, const std::filesystem::path& path, const BuildOptions& options,
                      const BuildBudget& budget, const std::function<WritePlace()>& place) {
  const VolumeInfo grid = checkedGrid(source.info(), options);
  checkPath(path);
  const std::filesystem::path folder = folderOf(path);

  Workers workers(budget.workers);
  Scan scan = scanSource(source, grid, options, budget, folder, workers);
  std::vector<std::size_t> guessed_otherwise;
  const VolumeInfo scanned = describeScanned(grid, scan, options, guessed_otherwise);
  BuiltLevels built = buildLevels(scan, scanned, budget, folder, options, workers);
  const auto [file, begin] = place();
  BuildReport report = writeVolume(file, begin, describeBuilt(scanned, built), built, *scan.spill, options, workers);
  report.guessed_otherwise = std::move(guessed_otherwise);
  return report;
}

}  // namespace blockwalk
