// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>

#include "clients/cli/flag_values.h"
#include "clients/cli/import_flags.h"
#include "clients/cli/progress.h"
#include "clients/cli/source_report.h"
#include "clients/cli/usage_error.h"
#include "volume/build/steps_builder.h"
#include "volume/error.h"
#include "volume/import/slices/slice_order.h"

namespace blockwalk {
namespace {

// What one step is made of.
struct StepSource {
  std::vector<std::filesystem::path> paths;
  ImportOptions options;
};

// Several sources are a step each; of one, what its axis of time has.
std::vector<StepSource> stepSources(const ImportFlags& flags, const ImportOptions& options) {
  const TimeFlag time = parseTime(flags.time);
  std::vector<std::filesystem::path> paths = flags.paths();
  const bool each = paths.size() > 1 && options.channels != ChannelRule::separate;
  if (each) orderByName(paths);  // t2 before t10, whatever order the shell has
  std::int64_t count = static_cast<std::int64_t>(paths.size());
  if (!each) {
    ImportOptions counting = options;
    counting.time = 0;
    counting.step_count = std::make_shared<std::int64_t>(0);
    openSource(paths, counting);
    count = std::max<std::int64_t>(*counting.step_count, 1);
  }
  const std::int64_t last = time.last.value_or(count - 1);
  if (last >= count) throw UsageError(fmt::format("--time: step {} is asked for, there are 0..{}", last, count - 1));
  if (last == time.first) {
    throw UsageError(fmt::format("--time {}: there is one step alone; leave --time out", flags.time));
  }
  if (last - time.first >= kMaxSteps) {
    throw UsageError(
        fmt::format("--time: {} steps are asked for, at most {} are one volume", last - time.first + 1, kMaxSteps));
  }
  std::vector<StepSource> steps;
  for (std::int64_t step = time.first; step <= last; ++step) {
    StepSource source{.paths = paths, .options = options};
    if (each) source.paths = {paths[static_cast<std::size_t>(step)]};
    source.options.time = std::nullopt;
    if (!each) source.options.time = step;
    steps.push_back(std::move(source));
  }
  return steps;
}

// Notes that differ in the step alone are printed once.
void printStepNotes(const std::vector<std::vector<std::string>>& notes) {
  constexpr std::size_t kMost = 20;
  std::vector<std::string> told;
  for (std::size_t step = 0; step < notes.size(); ++step) {
    for (const std::string& note : notes[step]) {
      const bool chooses = note.find("volumes, one after the other") != std::string::npos ||
                           note.find("steps in time it is number") != std::string::npos;
      if (chooses || std::ranges::find(told, note) != told.end()) continue;
      told.push_back(note);
      if (told.size() <= kMost) fmt::print("  note               step {}: {}\n", step, note);
    }
  }
  if (told.size() > kMost) fmt::print("  note               and {} more\n", told.size() - kMost);
}

void tellSteps(const std::vector<StepSource>& steps) {
  ImportOptions options = steps.front().options;
  const auto first = openToKeep(steps.front().paths, options);
  const SourceInfo& info = first->info();
  fmt::print("{}: {} steps of {} x {} x {} voxels of {}{}, {} dense each\n", info.name, steps.size(), info.dims.x,
             info.dims.y, info.dims.z, info.channels.size() > 1 ? fmt::format("{} x ", info.channels.size()) : "",
             voxelTypeName(info.type), byteText(cellCount(info.dims) * voxelBytes(info.type) * info.channels.size()));
  printSource(info);
  printStepNotes({info.notes});
}

}  // namespace

void importSteps(const ImportFlags& flags) {
  if (flags.frame) throw UsageError("--frame: chooses one volume, --time several; give one of them");
  const std::uint64_t memory_bytes = flags.build.memoryBytes();
  const ImportOptions options = flags.importOptions(memory_bytes);
  std::vector<StepSource> steps = stepSources(flags, options);
  if (flags.is_dry) return tellSteps(steps);
  flags.checkOutput();
  const auto begun = std::chrono::steady_clock::now();
  StepsBuilder builder(flags.build.output, static_cast<int>(steps.size()));
  std::vector<std::vector<std::string>> notes;
  std::optional<SourceInfo> first;
  std::optional<BuildOptions> build;
  std::uint64_t verified = 0;
  std::uint64_t file_bytes = 0;
  {
    Progress progress;
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const auto source = openToKeep(steps[i].paths, steps[i].options);
      if (!build) build = flags.buildOptions(memory_bytes - options.memory_bytes, source->info());
      build->progress = [&, i](std::string_view, std::uint64_t, std::uint64_t) {
        progress.show("steps", i, steps.size());
      };
      builder.add(*source, *build);
      notes.push_back(source->info().notes);
      if (!first) first = source->info();
    }
    // Before the file gets its name: what differs from its source must not take the place of what was there.
    file_bytes = builder.finish([&](const std::filesystem::path& complete) {
      if (!flags.verify) return;
      const VolumeFile file(complete);
      for (std::size_t i = 0; i < steps.size(); ++i) {
        verified += verifyVolume(*openSource(steps[i].paths, steps[i].options), file.atStep(static_cast<int>(i)));
        progress.show("verify", i + 1, steps.size());
      }
    });
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  const VolumeInfo& info = builder.steps().front().info;
  std::uint64_t subblocks = 0;
  for (const BuildReport& step : builder.steps()) subblocks += step.info.levels[0].subblock_count;
  fmt::print("{}: {} steps of {} x {} x {} voxels of {}{}, {} in {:.1f} s\n", flags.build.output, steps.size(),
             info.dims.x, info.dims.y, info.dims.z,
             info.channels.size() > 1 ? fmt::format("{} x ", info.channels.size()) : "", voxelTypeName(info.type),
             byteText(file_bytes), seconds);
  fmt::print("  level 0            {} subblocks of {} cubed voxels in all steps\n", subblocks, info.subblock_side);
  for (const std::filesystem::path& left : builder.leftovers()) {
    fmt::print("  stays              {}: without locks here nobody can tell whether it is being written\n",
               left.string());
  }
  printSource(*first);
  printValues(info, flags);
  printStepNotes(notes);
  const auto unlike =
      std::ranges::find_if(builder.steps(), [](const BuildReport& step) { return !step.guessed_otherwise.empty(); });
  if (unlike != builder.steps().end()) {
    fmt::print(
        "  note               step {} looks like labels, which the first does not; --values labels says that they "
        "are\n",
        unlike - builder.steps().begin());
  }
  if (flags.verify) fmt::print("  verified           {} voxels\n", verified);
}

}  // namespace blockwalk
