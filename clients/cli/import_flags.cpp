// SPDX-License-Identifier: Apache-2.0
#include "clients/cli/import_flags.h"

#include <fmt/format.h>

#include <charconv>
#include <system_error>

#include "clients/cli/flag_values.h"
#include "clients/cli/usage_error.h"
#include "volume/import/value_offset.h"

namespace blockwalk {
namespace {

std::int64_t parseStep(const std::string& text, const std::string& all) {
  std::int64_t step = 0;
  const char* end = text.data() + text.size();
  const auto [at, failure] = std::from_chars(text.data(), end, step);
  if (failure != std::errc{} || at != end || step < 0) {
    throw UsageError(fmt::format("--time: must be a step counted from 0, FIRST:LAST or all, not '{}'", all));
  }
  return step;
}

}  // namespace

TimeFlag parseTime(const std::string& text) {
  if (text == "all") return {.is_one = false};
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return {.first = parseStep(text, text)};
  const std::int64_t first = parseStep(text.substr(0, colon), text);
  const std::int64_t last = parseStep(text.substr(colon + 1), text);
  if (last < first) throw UsageError(fmt::format("--time: the last step, {}, comes before the first, {}", last, first));
  return {.first = first, .last = last, .is_one = false};
}

ImportOptions ImportFlags::importOptions(std::uint64_t memory_bytes) const {
  ImportOptions options;
  if (!dims.empty()) options.dims = parseDims("--dims", dims);
  if (!type.empty()) options.type = type;
  if (!spacing.empty()) options.spacing = parseSpacing("--spacing", spacing);
  options.channels = channels == "color"      ? ChannelRule::color
                     : channels == "fields"   ? ChannelRule::fields
                     : channels == "separate" ? ChannelRule::separate
                                              : ChannelRule::automatic;
  if (channels.size() == 1) options.raw_channels = channels[0] - '0';
  options.channel_names = channel_names;
  options.frame = frame;
  if (!series.empty()) options.series = series;
  options.level = level;
  if (!time.empty()) options.time = parseTime(time).first;
  if (!dataset.empty()) options.dataset = dataset;
  options.planar = planar;
  options.big_endian = big_endian;
  options.skip_bytes = parseByteSize("--skip", skip);
  options.density = density == "alpha"       ? DensityRule::alpha
                    : density == "luminance" ? DensityRule::luminance
                    : density == "max"       ? DensityRule::max
                                             : DensityRule::automatic;
  // Files that a decoder must hold in part get a quarter; the builder gets the rest.
  options.memory_bytes = memory_bytes / 4;
  return options;
}

BuildOptions ImportFlags::buildOptions(std::uint64_t memory_bytes, const SourceInfo& info) const {
  BuildOptions options = build.options(memory_bytes, info.dims);
  options.values = values == "labels"      ? ValuesRule::labels
                   : values == "intensity" ? ValuesRule::intensity
                                           : ValuesRule::guess;
  return options;
}

void ImportFlags::checkOutput() const {
  if (build.output.empty()) throw UsageError("-o: name the volume to make, or ask with --dry-run what it would be");
  for (const auto& path : paths()) {
    std::error_code absent;
    if (std::filesystem::equivalent(path, build.output, absent)) {
      throw UsageError(fmt::format("-o: {} is a source of this import", build.output));
    }
  }
}

std::unique_ptr<Source> openToKeep(const std::vector<std::filesystem::path>& paths, ImportOptions& options) {
  auto source = openSource(paths, options);
  if (!source->info().may_round) return source;
  options.value_offset = offsetThatKeeps(*source);
  return openSource(paths, options);  // what was read is behind it
}

void printNotes(const std::vector<std::string>& notes, const ImportOptions& options) {
  if (options.value_offset) {
    fmt::print("  note               samples are stored less {}, which 32-bit floats would round otherwise\n",
               *options.value_offset);
  }
  for (const std::string& note : notes) fmt::print("  note               {}\n", note);
}

void printValues(const VolumeInfo& info, const ImportFlags& flags) {
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    if (info.channels[i].values != ChannelValues::labels) continue;
    const std::string name = info.channels.size() > 1 ? fmt::format("channel {}: ", i) : "";
    fmt::print("  values             {}labels{}: coarser levels keep the most frequent, nothing lies between two\n",
               name, flags.values == "auto" ? " (a guess; --values intensity says otherwise)" : "");
  }
}

}  // namespace blockwalk
