// SPDX-License-Identifier: Apache-2.0
#include "protocol/slice_picture.h"

#include <algorithm>
#include <cmath>

#include "protocol/image_codec.h"
#include "volume/slice/slice_bytes.h"

namespace blockwalk {
namespace {

// Display-referred, 0..1; beyond the ends theirs.
glm::dvec3 colorAt(const std::vector<TransferPoint>& points, double value) {
  const auto above = std::ranges::upper_bound(points, value, {}, &TransferPoint::value);
  if (above == points.begin()) return above->color;
  const TransferPoint& low = *(above - 1);
  if (above == points.end()) return low.color;
  const double share = (value - low.value) / (above->value - low.value);
  return low.color + share * (above->color - low.color);
}

glm::dvec3 colorOf(const ChannelLook& look, double value) {
  if (!look.transfer.empty()) return colorAt(look.transfer, value);
  const auto [lo, hi] = look.window;
  const double share = hi > lo ? std::clamp((value - lo) / (hi - lo), 0.0, 1.0) : value >= hi ? 1.0 : 0.0;
  return (look.gamma == 1 ? share : std::pow(share, look.gamma)) * look.color;
}

std::uint32_t rgbaOf(const glm::dvec3& color) {
  std::uint32_t rgba = 0xff000000u;
  for (int i = 0; i < 3; ++i) {
    rgba |= static_cast<std::uint32_t>(std::lround(255 * std::clamp(color[i], 0.0, 1.0))) << (8 * i);
  }
  return rgba;
}

}  // namespace

Frame slicePicture(const VolumeInfo& info, const ResolvedSlice& slice, const SlicePixels& pixels) {
  Frame frame;
  frame.width = slice.plan.width;
  frame.height = slice.plan.height;
  frame.pixels = pixels.colors;
  if (info.type == VoxelType::rgba8) return frame;
  frame.pixels.resize(slice.plan.pixels());
  for (std::size_t pixel = 0; pixel < frame.pixels.size(); ++pixel) {
    glm::dvec3 color(0);
    bool has_number = false;
    for (std::size_t i = 0; i < slice.looks.size(); ++i) {
      const ChannelInfo& channel = info.channels[static_cast<std::size_t>(slice.plan.channels[i])];
      const float stored = pixels.values[i][pixel];
      const bool is_nothing =
          channel.values == ChannelValues::labels && isEmptyDensity(stored, channel.empty_threshold);
      if (!std::isfinite(stored) || is_nothing) continue;
      has_number = true;
      color += colorOf(slice.looks[i], channel.dataFromStored(static_cast<double>(stored)));
    }
    frame.pixels[pixel] = has_number ? rgbaOf(color) : 0;
  }
  return frame;
}

std::vector<std::byte> encodeSlice(const VolumeFile& file, const ResolvedSlice& slice, const SlicePixels& pixels) {
  if (!slice.isPicture()) {
    return sliceBytes(file, slice.plan, pixels, exportFormat(slice.format).value_or(ExportFormat::raw));
  }
  const ImageFormat format = slice.format == "webp" ? ImageFormat::webp : ImageFormat::png;
  return encodeImage(slicePicture(file.info(), slice, pixels), format, kLosslessWebp);
}

}  // namespace blockwalk
