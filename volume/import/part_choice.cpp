// SPDX-License-Identifier: Apache-2.0
#include "volume/import/part_choice.h"

#include <algorithm>
#include <array>

#include "volume/error.h"
#include "volume/import/geometry.h"
#include "volume/volume.h"

namespace blockwalk {

std::uint64_t chosenStep(const ImportOptions& options, std::uint64_t steps, const std::string& name,
                         std::vector<std::string>& notes) {
  options.tellSteps(static_cast<std::int64_t>(std::min<std::uint64_t>(steps, INT64_MAX)));
  const auto step = static_cast<std::uint64_t>(options.time.value_or(0));
  if (steps == 0) failData("{}: has no steps in time", name);
  if (step >= steps) failData("{}: time {} is asked for, must be 0..{}", name, step, steps - 1);
  if (steps > 1)
    notes.push_back(
        fmt::format("of the {} steps in time it is number {}; --time chooses, --time all imports all", steps, step));
  return step;
}

void setPartSizes(const std::vector<std::uint64_t>& shape, const std::string& name, ArrayPart& part,
                  std::vector<std::string>& notes) {
  std::array<std::int64_t, 3> dims{1, 1, 1};
  for (std::size_t i = 0; i < 3; ++i) {
    if (part.space[i]) dims[i] = static_cast<std::int64_t>(std::min<std::uint64_t>(shape[*part.space[i]], INT64_MAX));
  }
  part.dims = checkedDims(dims[0], dims[1], dims[2], name, "shape");
  if (!part.channel) return;
  const std::uint64_t channels = shape[*part.channel];
  part.channels = std::min<std::uint64_t>(channels, kMaxChannels);
  if (channels > part.channels) {
    notes.push_back(fmt::format("of {} channels it has the first {}", channels, part.channels));
  }
}

}  // namespace blockwalk
