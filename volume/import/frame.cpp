// SPDX-License-Identifier: Apache-2.0
#include "volume/import/frame.h"

#include "volume/error.h"

namespace blockwalk {

std::uint64_t chosenFrame(const ImportOptions& options, std::int64_t frames, const std::string& source,
                          const std::string& field, std::vector<std::string>& notes) {
  if (frames == 1 && options.frame.value_or(0) == 0) return 0;
  if (!options.frame) {
    notes.push_back(
        fmt::format("{}: of {} volumes, one after the other, it is the first; --frame chooses another", field, frames));
    return 0;
  }
  if (*options.frame < 0 || *options.frame >= frames) {
    failData("{}: {}: --frame {} is outside 0..{}", source, field, *options.frame, frames - 1);
  }
  notes.push_back(fmt::format("{}: of {} volumes, one after the other, it is the one that is counted {} from 0", field,
                              frames, *options.frame));
  return static_cast<std::uint64_t>(*options.frame);
}

}  // namespace blockwalk
