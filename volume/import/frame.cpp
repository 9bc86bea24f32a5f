// SPDX-License-Identifier: Apache-2.0
#include "volume/import/frame.h"

#include "volume/error.h"

namespace blockwalk {

std::uint64_t chosenFrame(const ImportOptions& options, std::int64_t frames, const std::string& source,
                          const std::string& field, std::vector<std::string>& notes) {
  options.tellSteps(frames);
  const std::int64_t chosen = options.frame ? *options.frame : options.time.value_or(0);
  if (frames == 1 && chosen == 0) return 0;
  if (!options.choosesStep()) {
    notes.push_back(fmt::format(
        "{}: of {} volumes, one after the other, it is the first; --frame chooses another, --time all imports all",
        field, frames));
    return 0;
  }
  if (chosen < 0 || chosen >= frames) {
    failData("{}: {}: --{} {} is outside 0..{}", source, field, options.frame ? "frame" : "time", chosen, frames - 1);
  }
  notes.push_back(fmt::format("{}: of {} volumes, one after the other, it is the one that is counted {} from 0", field,
                              frames, chosen));
  return static_cast<std::uint64_t>(chosen);
}

}  // namespace blockwalk
