// SPDX-License-Identifier: Apache-2.0
#include "view/channel_window.h"

namespace blockwalk {
namespace {

// Stored units.
double quantile(const ChannelInfo& channel, double share) {
  const auto lo = static_cast<double>(channel.histogram_lo);
  const auto hi = static_cast<double>(channel.histogram_hi);
  double total = 0;
  for (const std::uint64_t count : channel.histogram) total += static_cast<double>(count);
  const double wanted = share * total;
  double below = 0;
  for (std::size_t bin = 0; bin < channel.histogram.size(); ++bin) {
    const auto count = static_cast<double>(channel.histogram[bin]);
    if (count > 0 && below + count >= wanted) {
      return lo + (hi - lo) / kHistogramBins * (static_cast<double>(bin) + (wanted - below) / count);
    }
    below += count;
  }
  return hi;
}

}  // namespace

DensityRange quantileWindow(const ChannelInfo& channel) {
  double black = quantile(channel, kBlackShare);
  double white = quantile(channel, kWhiteShare);
  if (!(black < white)) {
    black = static_cast<double>(channel.histogram_lo);
    white = static_cast<double>(channel.histogram_hi);
  }
  return {.lo = channel.dataFromStored(black), .hi = channel.dataFromStored(white)};
}

}  // namespace blockwalk
