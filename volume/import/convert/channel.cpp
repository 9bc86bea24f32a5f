// SPDX-License-Identifier: Apache-2.0
#include "volume/import/convert/channel.h"

#include <cstring>
#include <utility>

#include "volume/error.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

bool becomesColor(const SampleFormat& format, bool is_color, const ImportOptions& options, const std::string& source) {
  if (format.channels == 1) {
    if (options.channels == ChannelRule::color)
      failData("{}: channels: the voxels are single values, no colours", source);
    return true;  // one sample, one channel
  }
  if (options.channels == ChannelRule::color) return true;
  if (options.channels == ChannelRule::automatic && is_color) return true;
  if (format.channels > kMaxChannels) {
    failData("{}: channels: {} samples a voxel, at most {} can be channels", source, format.channels, kMaxChannels);
  }
  return false;
}

std::vector<VoxelConverter> fieldConverters(SampleFormat format, std::size_t count, const ImportOptions& options,
                                            const std::string& source) {
  format.channels = 1;
  VoxelConverter converter(format, options.density, source);
  if (options.value_offset) converter.moveBy(*options.value_offset);
  return std::vector<VoxelConverter>(count, converter);
}

// Sample `index` of every voxel, one after the other.
void takeSamples(std::span<const std::byte> voxels, const SampleFormat& format, std::size_t index,
                 std::span<std::byte> out) {
  const std::size_t bytes = sampleBytes(format.type);
  const std::size_t stride = format.voxelBytes();
  const std::byte* from = voxels.data() + index * bytes;
  for (std::size_t at = 0; at < out.size(); at += bytes, from += stride) std::memcpy(&out[at], from, bytes);
}

}  // namespace

ChannelConverter::ChannelConverter(const SampleFormat& format, bool is_color, const ImportOptions& options,
                                   const std::string& source)
    : format_(format) {
  if (becomesColor(format, is_color, options, source)) {
    converters_.emplace_back(format, options.density, source);
    if (options.value_offset) converters_.back().moveBy(*options.value_offset);
  } else {
    converters_ = fieldConverters(format, static_cast<std::size_t>(format.channels), options, source);
  }
}

ChannelConverter ChannelConverter::ofPlanes(const SampleFormat& format, std::size_t channels,
                                            const ImportOptions& options, const std::string& source) {
  BLOCKWALK_CHECK(format.channels, ==, 1);
  BLOCKWALK_CHECK(channels, <=, static_cast<std::size_t>(kMaxChannels));
  if (options.channels == ChannelRule::color) {
    failData("{}: channels: they lie in planes of their own, which cannot be read as colour", source);
  }
  return {format, fieldConverters(format, channels, options, source)};
}

ChannelConverter ChannelConverter::anew() const {
  ChannelConverter other(format_, converters_);
  for (VoxelConverter& converter : other.converters_) converter.forgetReport();
  return other;
}

void ChannelConverter::describe(SourceInfo& info, const ImportOptions& options) const {
  info.type = converters_[0].voxelType();
  info.may_round = converters_[0].mayRound();
  info.channels.assign(
      channels(),
      {.name = {}, .value_scale = converters_[0].valueScale(), .value_offset = converters_[0].valueOffset()});
  nameChannels(info, options);
}

void ChannelConverter::convert(std::span<std::byte> samples, std::size_t first, std::span<std::byte> rows) {
  if (channels() == 1) return convertPlane(0, samples, first, rows);
  plane_.resize(samples.size() / channels());
  for (std::size_t channel = 0; channel < channels(); ++channel) {
    takeSamples(samples, format_, channel, plane_);
    convertPlane(channel, plane_, first, rows);
  }
}

void ChannelConverter::convertPlane(std::size_t channel, std::span<std::byte> samples, std::size_t first,
                                    std::span<std::byte> rows) {
  VoxelConverter& converter = converters_[channel];
  const std::size_t bytes = voxelBytes(converter.voxelType());
  const std::size_t plane = rows.size() / channels();
  const std::size_t count = samples.size() / converter.format().voxelBytes();
  converter.convert(samples, rows.subspan(channel * plane + first * bytes, count * bytes));
}

void nameChannels(SourceInfo& info, const ImportOptions& options) {
  const std::vector<std::string>& names = options.channel_names;
  if (names.empty()) return;
  if (info.channels.size() == 1) failData("{}: channel names: there is one channel, which has no name", info.name);
  if (names.size() != info.channels.size()) {
    failData("{}: channel names: {} are given, there are {} channels", info.name, names.size(), info.channels.size());
  }
  for (std::size_t i = 0; i < names.size(); ++i) info.channels[i].name = names[i];
}

void describeAs(const SourceChannel& said, bool has_name, SourceChannel& channel) {
  if (has_name) channel.name = said.name;
  if (!said.unit.empty()) channel.unit = said.unit;
  channel.color = said.color;
  channel.window = said.window;
  channel.is_labels = said.is_labels;
  channel.labels = said.labels;
  channel.value_offset = said.value_offset + said.value_scale * channel.value_offset;
  channel.value_scale *= said.value_scale;
}

}  // namespace blockwalk
