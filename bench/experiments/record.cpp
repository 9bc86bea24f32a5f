// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments/record.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>

namespace blockwalk::bench {

nlohmann::json newRecord(const std::string& experiment, const Renderer& renderer, const ExperimentOptions& options) {
  const DeviceInfo device = renderer.device();
  return {{"experiment", experiment},
          {"device", device.name},
          {"driver", device.driver + " " + device.driver_version},
          {"date", fmt::format("{:%Y-%m-%d}", fmt::gmtime(std::time(nullptr)))},
          {"size", {options.width, options.height}},
          {"samples", options.samples}};
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace blockwalk::bench
