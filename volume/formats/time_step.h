// SPDX-License-Identifier: Apache-2.0
// How far apart steps in time are, as formats say it and as volumes keep it.
#pragma once

#include <string>
#include <string_view>

namespace blockwalk {

constexpr std::string_view kTimeStepKey = "time_step";  // of the metadata

// "0.5 s"; empty where the step is no finite number above 0. Units are seconds, milliseconds ... as microscopes and
// scanners write them; one that is not known stays as it is.
std::string timeStepText(double step, std::string_view unit);

}  // namespace blockwalk
