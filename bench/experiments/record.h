// SPDX-License-Identifier: Apache-2.0
// What every experiment's JSON begins with, and how it sums up its times.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/experiments/experiments.h"

namespace blockwalk::bench {

// {"experiment", "device", "driver", "date", "size", "samples"}
nlohmann::json newRecord(const std::string& experiment, const Renderer& renderer, const ExperimentOptions& options);

// The upper one of two in the middle. `values` is not empty.
double median(std::vector<double> values);

}  // namespace blockwalk::bench
