// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <span>
#include <string_view>

#include "view/label_colors.h"
#include "view/view.h"

namespace blockwalk {
namespace {

constexpr double kThinOpacity = 0.06;  // over the unit distance
constexpr double kBodyOpacity = 0.4;

// The histogram bin that best separates background from body: the threshold of largest variance between the two classes
// (Otsu 1979).
int otsuBin(const std::array<std::uint64_t, kHistogramBins>& counts) {
  double total = 0;
  double moment = 0;
  for (int i = 0; i < kHistogramBins; ++i) {
    total += static_cast<double>(counts[static_cast<std::size_t>(i)]);
    moment += i * static_cast<double>(counts[static_cast<std::size_t>(i)]);
  }
  double below = 0;
  double moment_below = 0;
  double best = -1;
  int bin = 0;
  for (int i = 0; i < kHistogramBins - 1; ++i) {
    below += static_cast<double>(counts[static_cast<std::size_t>(i)]);
    moment_below += i * static_cast<double>(counts[static_cast<std::size_t>(i)]);
    if (below <= 0 || below >= total) continue;
    const double difference = moment_below / below - (moment - moment_below) / (total - below);
    const double variance = below * (total - below) * difference * difference;
    if (variance > best) {
      best = variance;
      bin = i;
    }
  }
  return bin;
}

int percentileBin(const std::array<std::uint64_t, kHistogramBins>& counts, double share) {
  double total = 0;
  for (const auto count : counts) total += static_cast<double>(count);
  double below = 0;
  for (int i = 0; i < kHistogramBins; ++i) {
    below += static_cast<double>(counts[static_cast<std::size_t>(i)]);
    if (below >= share * total) return i;
  }
  return kHistogramBins - 1;
}

glm::dvec3 colorOf(std::uint32_t rgb) { return glm::dvec3(rgb >> 16, rgb >> 8 & 255u, rgb & 255u) / 255.0; }

// Where the body of the data begins, where it is well under way, and where it ends, data units.
struct Body {
  double first = 0;
  double middle = 0;
  double last = 0;
  bool isFlat() const { return !(first < middle && middle < last); }
};

// What the source says to show first, where it says so.
Body bodyOf(const ChannelInfo& channel) {
  if (channel.window && (*channel.window)[0] < (*channel.window)[1]) {
    const auto [first, last] = *channel.window;
    return {.first = first, .middle = 0.5 * (first + last), .last = last};
  }
  const double width = (static_cast<double>(channel.histogram_hi) - channel.histogram_lo) / kHistogramBins;
  const auto at = [&](double bin) { return channel.dataFromStored(channel.histogram_lo + width * bin); };
  if (channel.density_min == channel.density_max) return {};
  return {.first = at(otsuBin(channel.histogram) * 0.6),
          .middle = at(otsuBin(channel.histogram) + 1.0),
          .last = at(percentileBin(channel.histogram, 0.998) + 1.0)};
}

// Colours evenly over the body; opacity begins at its first value, is thin in the middle and moderate at its end.
std::vector<TransferPoint> ramp(const VolumeInfo& info, const ChannelInfo& channel,
                                std::span<const std::uint32_t> colors) {
  const Body body = bodyOf(channel);
  if (body.isFlat()) {
    // One value, a mask: thin enough to see into, whatever its size.
    const int least = std::min({info.dims.x, info.dims.y, info.dims.z});
    return {{.value = channel.dataFromStored(channel.density_min),
             .color = colorOf(colors[colors.size() / 2]),
             .opacity = std::min(0.3, 4.0 / least)}};
  }
  std::vector<TransferPoint> points;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(colors.size() - 1);
    const double value = body.first + share * (body.last - body.first);
    const double opacity = value < body.middle ? kThinOpacity * (value - body.first) / (body.middle - body.first)
                                               : kThinOpacity + (kBodyOpacity - kThinOpacity) * (value - body.middle) /
                                                                    (body.last - body.middle);
    points.push_back({.value = value, .color = colorOf(colors[i]), .opacity = opacity});
  }
  return points;
}

std::uint32_t rgbOf(const Color& color) {
  return std::uint32_t{color[0]} << 16 | std::uint32_t{color[1]} << 8 | color[2];
}

// A colour and black, a share of each, in whole bytes: so the points' text form gives the same colour back.
std::uint32_t shareOf(std::uint32_t rgb, double share) {
  const auto byte = [&](int shift) {
    return static_cast<std::uint32_t>(std::lround(share * (rgb >> shift & 255u))) << shift;
  };
  return byte(16) | byte(8) | byte(0);
}

std::vector<TransferPoint> automatic(const VolumeInfo& info, std::size_t number) {
  constexpr std::array<std::uint32_t, 3> kWarm{0x5c1c0f, 0xdb8c54, 0xfff7e6};
  const ChannelInfo& channel = info.channels[number];
  const Body body = bodyOf(channel);
  std::array<std::uint32_t, 3> colors = kWarm;
  if (info.channels.size() > 1) {
    const std::uint32_t full = rgbOf(channelColor(channel, number));
    const double middle = body.isFlat() ? 1 : (body.middle - body.first) / (body.last - body.first);
    // As with the warm colours, what is thin is dark and yet to be seen: a first hit lies where opacity begins.
    constexpr double kDark = 0.35;
    colors = {shareOf(full, kDark), shareOf(full, kDark + (1 - kDark) * middle), full};
  }
  if (body.isFlat()) return ramp(info, channel, colors);
  return {{.value = body.first, .color = colorOf(colors[0]), .opacity = 0},
          {.value = body.middle, .color = colorOf(colors[1]), .opacity = kThinOpacity},
          {.value = body.last, .color = colorOf(colors[2]), .opacity = kBodyOpacity}};
}

struct FixedPoint {
  double value;
  std::uint32_t rgb;
  double opacity;
};

// Points in Hounsfield units; the first is transparent.
std::vector<TransferPoint> hounsfield(const ChannelInfo& channel, std::string_view name,
                                      std::span<const FixedPoint> fixed) {
  if (!(channel.dataFromStored(channel.density_max) > fixed[0].value)) {
    throw ViewError("tf", fmt::format("{} shows what is above {} Hounsfield units; this volume's values end at {}",
                                      name, fixed[0].value, channel.dataFromStored(channel.density_max)));
  }
  std::vector<TransferPoint> points;
  for (const FixedPoint& point : fixed) {
    points.push_back({.value = point.value, .color = colorOf(point.rgb), .opacity = point.opacity});
  }
  return points;
}

// Tenths of the perceptually uniform maps of matplotlib (Smith and van der Walt 2015; cividis: Nunez et al. 2018).
constexpr std::array<std::uint32_t, 11> kViridis{0x440154, 0x482475, 0x414487, 0x355f8d, 0x2a788e, 0x21918c,
                                                 0x22a884, 0x44bf70, 0x7ad151, 0xbddf26, 0xfde725};
constexpr std::array<std::uint32_t, 11> kCividis{0x00224e, 0x083370, 0x35456c, 0x4f576c, 0x666970, 0x7d7c78,
                                                 0x948e77, 0xaea371, 0xc8b866, 0xe5cf52, 0xfee838};
constexpr std::array<std::uint32_t, 11> kInferno{0x000004, 0x160b39, 0x420a68, 0x6a176e, 0x932667, 0xbc3754,
                                                 0xdd513a, 0xf37819, 0xfca50a, 0xf6d746, 0xfcffa4};
constexpr std::array<std::uint32_t, 2> kGrey{0x000000, 0xffffff};
// Cortical bone lies above 300 Hounsfield units, muscle at 40 to 60, fat near -100, contrast-filled vessels at 150 to
// 500.
constexpr std::array<FixedPoint, 4> kBone{
    {{130, 0xa5825f, 0}, {300, 0xd9c3a3, 0.12}, {700, 0xf2e8d6, 0.6}, {1500, 0xffffff, 0.9}}};
constexpr std::array<FixedPoint, 6> kSoftTissue{{{-200, 0xe8c39e, 0},
                                                 {-90, 0xe8c39e, 0.012},
                                                 {20, 0xc8694c, 0.06},
                                                 {80, 0xb04a3a, 0.15},
                                                 {200, 0xe8d8bc, 0.4},
                                                 {1000, 0xffffff, 0.8}}};
constexpr std::array<FixedPoint, 5> kVessels{
    {{120, 0x5a0c0c, 0}, {180, 0xb01818, 0.2}, {350, 0xe04a2a, 0.6}, {600, 0xf5dcc0, 0.7}, {1500, 0xffffff, 0.8}}};
// 200, where kSoftTissue has come to the colour of bone: spongy bone is as dense, no soft tissue is. What ends below
// it, a phantom or a part that was cut out, would be of one colour or two; the ramp of its own histogram tells more
// apart.
constexpr double kLeastBone = kSoftTissue[4].value;

// CT: the same tissue has the same value in every scan.
bool isHounsfield(const ChannelInfo& channel) {
  std::string unit = channel.unit;
  std::ranges::transform(unit, unit.begin(), [](unsigned char c) { return std::tolower(c); });
  return unit == "hu" || unit == "hounsfield" || unit == "hounsfield units";
}

bool isBodyInCt(const VolumeInfo& info, const ChannelInfo& channel) {
  return info.channels.size() == 1 && isHounsfield(channel) && channel.dataFromStored(channel.density_max) > kLeastBone;
}

}  // namespace

Color channelColor(const ChannelInfo& channel, std::size_t number) {
  constexpr std::array<Color, kMaxChannels> kOfChannels{
      {{0x00, 0xff, 0x00}, {0xff, 0x00, 0xff}, {0x00, 0xff, 0xff}, {0xff, 0xff, 0x00}}};
  return channel.color.value_or(kOfChannels.at(number));
}

std::vector<TransferPoint> presetTransfer(TransferPreset preset, const VolumeInfo& info, std::size_t number) {
  const ChannelInfo& channel = info.channels[number];
  switch (preset) {
    case TransferPreset::automatic:
      if (channel.values == ChannelValues::labels) return labelTransfer(channel);
      return isBodyInCt(info, channel) ? hounsfield(channel, "ct-soft-tissue", kSoftTissue) : automatic(info, number);
    case TransferPreset::grey:
      return ramp(info, channel, kGrey);
    case TransferPreset::viridis:
      return ramp(info, channel, kViridis);
    case TransferPreset::cividis:
      return ramp(info, channel, kCividis);
    case TransferPreset::inferno:
      return ramp(info, channel, kInferno);
    case TransferPreset::ct_bone:
      return hounsfield(channel, "ct-bone", kBone);
    case TransferPreset::ct_soft_tissue:
      return hounsfield(channel, "ct-soft-tissue", kSoftTissue);
    case TransferPreset::angiography:
      return hounsfield(channel, "angiography", kVessels);
  }
  return {};
}

}  // namespace blockwalk
