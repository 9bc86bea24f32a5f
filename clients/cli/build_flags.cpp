// SPDX-License-Identifier: Apache-2.0
#include "clients/cli/build_flags.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "clients/cli/flag_values.h"
#include "clients/cli/usage_error.h"
#include "volume/build/fitting_sides.h"
#include "volume/codec_name.h"
#include "volume/host_limits.h"

namespace blockwalk {

void BuildFlags::add(CLI::App& command) {
  command.add_option("-o", output, "file to write")->required()->type_name("FILE.bwv");
  command
      .add_option("--subblock", subblock_side,
                  "side of a subblock in voxels: 4, 8 or 16 (8; 4 where few slices fill it better)")
      ->check(CLI::IsMember({4, 8, 16}));
  command.add_option("--block", block_side, "side of a block in subblocks, 1..6 (6)")
      ->check(CLI::Range(1, kMaxBlockSide));
  command.add_option("--bins", bins, "cuts of the range masks: auto, uniform or quantile (auto)")
      ->check(CLI::IsMember({"auto", "uniform", "quantile"}));
  command
      .add_option("--empty", empty_thresholds,
                  "voxels up to this density are empty (0, or the smallest value); one number, or one a channel")
      ->delimiter(',')
      ->type_name("N[,N...]");
  command
      .add_option(
          "--codec", codec,
          "how voxels are packed: raw, lz4 (reads fastest of the two) or zstd (packs most) (raw; lz4 where subblocks "
          "are half empty for want of slices)")
      ->check(CLI::IsMember({"raw", "lz4", "zstd"}));
  command.add_option("--memory", memory, "memory to stay within, at least 96MiB (half of what is free, 96MiB to 2GiB)")
      ->type_name("SIZE");
}

std::uint64_t BuildFlags::memoryBytes() const {
  // The builder needs 64 MiB, and an import keeps a quarter of the memory for its decoder.
  constexpr std::uint64_t kLeast = std::uint64_t{96} << 20;
  constexpr std::uint64_t kMostUnasked = std::uint64_t{2} << 30;
  if (!memory) return std::clamp(freeHostBytes() / 2, kLeast, kMostUnasked);
  const std::uint64_t bytes = parseByteSize("--memory", *memory);
  if (bytes < kLeast) throw UsageError(fmt::format("--memory: {} is less than 96MiB", *memory));
  return bytes;
}

BuildOptions BuildFlags::options(std::uint64_t memory_bytes, glm::ivec3 dims) const {
  for (const double threshold : empty_thresholds) {
    if (!std::isfinite(threshold)) throw UsageError("--empty: must be finite");
  }
  BuildOptions result;
  result.subblock_side = subblock_side.value_or(fittingSubblockSide(dims));
  result.block_side = block_side;
  result.memory_bytes = memory_bytes;
  result.empty_thresholds = empty_thresholds;
  result.mask_bins = bins == "uniform"    ? MaskBins::uniform
                     : bins == "quantile" ? MaskBins::quantile
                                          : MaskBins::automatic;
  // What lies beyond the sides is zeros, which take no place then.
  const bool is_thin = paddingFactor(dims, result.subblock_side) > 1.5;
  const std::string packing = codec.value_or(is_thin ? "lz4" : "raw");
  result.codec = packing == "lz4" ? Codec::lz4 : packing == "zstd" ? Codec::zstd : Codec::raw;
  return result;
}

namespace {

double percent(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

void printChannels(const VolumeInfo& info, std::uint64_t voxels) {
  for (std::size_t i = 0; info.channels.size() > 1 && i < info.channels.size(); ++i) {
    const ChannelInfo& channel = info.channels[i];
    fmt::print("  channel {}          {}\n", i, channel.name);
    fmt::print("    non-empty voxels {} ({:.2f} %)\n", channel.nonempty_voxels,
               percent(channel.nonempty_voxels, voxels));
    fmt::print("    not finite       {} voxels\n", channel.nonfinite_voxels);
    fmt::print("    largest rounding {}\n", channel.largest_rounding);
  }
}

// "2 raw, 130 zstd"
std::string pagesText(const VolumeInfo& info) {
  std::string text;
  for (std::size_t i = 0; i < info.pages.size(); ++i) {
    if (info.pages[i] == 0) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", info.pages[i], codecName(static_cast<Codec>(i)));
  }
  return text.empty() ? "none" : text;
}

}  // namespace

void printBuildReport(const BuildReport& report, const std::filesystem::path& path, double seconds) {
  const VolumeInfo& info = report.info;
  const ChannelInfo& channel = info.channels[0];
  const bool several = info.channels.size() > 1;
  const std::uint64_t voxels = static_cast<std::uint64_t>(info.dims.x) * static_cast<std::uint64_t>(info.dims.y) *
                               static_cast<std::uint64_t>(info.dims.z);
  const std::uint64_t dense_bytes = voxels * voxelBytes(info.type) * info.channels.size();
  fmt::print("{}: {} x {} x {} voxels of {}{}, {} levels, {} blocks\n", path.string(), info.dims.x, info.dims.y,
             info.dims.z, several ? fmt::format("{} x ", info.channels.size()) : "", voxelTypeName(info.type),
             info.levels.size(), info.levels.at(0).block_count);
  if (!several) {
    fmt::print("  non-empty voxels   {} ({:.2f} %)\n", channel.nonempty_voxels,
               percent(channel.nonempty_voxels, voxels));
  }
  fmt::print("  level 0 voxels     {}\n", byteText(report.level0_voxel_bytes));
  fmt::print("  pages              {}\n", pagesText(info));
  fmt::print("  coarser levels     {}\n", byteText(report.coarser_level_bytes));
  fmt::print("  records and rest   {}\n", byteText(report.overhead_bytes));
  fmt::print("  file               {} ({:.2f} % of {} dense)\n", byteText(report.file_bytes),
             percent(report.file_bytes, dense_bytes), byteText(dense_bytes));
  if (!several) {
    fmt::print("  not finite         {} voxels\n", channel.nonfinite_voxels);
    fmt::print("  largest rounding   {}\n", channel.largest_rounding);
  }
  printChannels(info, voxels);
  for (const std::filesystem::path& leftover : report.leftovers) {
    fmt::print("  stays              {}: without locks here nobody can tell whether it is being written\n",
               leftover.string());
  }
  fmt::print("  time               {:.2f} s\n", seconds);
}

}  // namespace blockwalk
