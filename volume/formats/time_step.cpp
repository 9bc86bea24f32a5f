// SPDX-License-Identifier: Apache-2.0
#include "volume/formats/time_step.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "volume/formats/text.h"

namespace blockwalk {

std::string timeStepText(double step, std::string_view unit) {
  if (!std::isfinite(step) || !(step > 0)) return {};
  constexpr std::array<std::pair<std::string_view, std::string_view>, 12> kNames{{{"sec", "s"},
                                                                                  {"second", "s"},
                                                                                  {"seconds", "s"},
                                                                                  {"msec", "ms"},
                                                                                  {"millisecond", "ms"},
                                                                                  {"milliseconds", "ms"},
                                                                                  {"microsecond", "us"},
                                                                                  {"\xc2\xb5s", "us"},
                                                                                  {"nanosecond", "ns"},
                                                                                  {"minute", "min"},
                                                                                  {"hour", "h"},
                                                                                  {"day", "d"}}};
  std::string name = lowerCase(unit);
  for (const auto& [said, kept] : kNames) {
    if (name == said) name = kept;
  }
  constexpr std::size_t kMostBytes = 32;
  if (name.empty() || name.size() > kMostBytes) return fmt::format("{}", step);
  return fmt::format("{} {}", step, name);
}

}  // namespace blockwalk
