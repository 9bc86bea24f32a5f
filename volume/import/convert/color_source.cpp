// SPDX-License-Identifier: Apache-2.0
#include "volume/import/convert/color_source.h"

#include <cstring>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/convert/voxel.h"

namespace blockwalk {
namespace {

class ColorSource final : public Source {
 public:
  ColorSource(std::unique_ptr<Source> channels, VoxelConverter converter)
      : channels_(std::move(channels)), converter_(std::move(converter)), info_(channels_->info()) {
    info_.type = VoxelType::rgba8;
    info_.channels.assign(1, {});
    if (!info_.blank.empty()) info_.blank = colorsOf(info_.blank);
  }

  const SourceInfo& info() const override { return info_; }
  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    planes_.resize(out.size() / voxelBytes(VoxelType::rgba8) * voxelBytes(channels_->info().type) *
                   channels_->info().channels.size());
    channels_->readRows(z, y, count, planes_);
    convert(planes_, out);
  }
  std::unique_ptr<Source> another() const override {
    auto other = channels_->another();
    if (!other) return nullptr;
    VoxelConverter converter = converter_;
    converter.forgetReport();
    return std::make_unique<ColorSource>(std::move(other), std::move(converter));
  }
  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override { channels_->findRuns(box, runs); }
  void readBox(const VoxelBox& box, std::span<std::byte> out) override {
    planes_.resize(box.voxels() * voxelBytes(channels_->info().type) * channels_->info().channels.size());
    channels_->readBox(box, planes_);
    convert(planes_, out);
  }
  ConversionReport conversion(std::size_t) const override { return converter_.report(); }

 private:
  // From channel after channel to voxel after voxel.
  void convert(std::span<const std::byte> planes, std::span<std::byte> out) {
    const std::size_t width = voxelBytes(channels_->info().type);
    const std::size_t count = channels_->info().channels.size();
    const std::size_t voxels = planes.size() / (width * count);
    samples_.resize(planes.size());
    for (std::size_t channel = 0; channel < count; ++channel) {
      const std::byte* from = planes.data() + channel * voxels * width;
      std::byte* to = samples_.data() + channel * width;
      for (std::size_t i = 0; i < voxels; ++i) std::memcpy(to + i * count * width, from + i * width, width);
    }
    converter_.convert(samples_, out);
  }
  std::vector<std::byte> colorsOf(const std::vector<std::byte>& planes) {
    std::vector<std::byte> colors(voxelBytes(VoxelType::rgba8));
    convert(planes, colors);
    converter_.forgetReport();
    return colors;
  }

  std::unique_ptr<Source> channels_;
  VoxelConverter converter_;
  SourceInfo info_;
  std::vector<std::byte> planes_;
  std::vector<std::byte> samples_;
};

}  // namespace

std::unique_ptr<Source> makeColorSource(std::unique_ptr<Source> channels, const ImportOptions& options) {
  const SourceInfo& info = channels->info();
  const auto count = static_cast<int>(info.channels.size());
  bool is_plain = info.type == VoxelType::u8 || info.type == VoxelType::u16;
  for (const SourceChannel& channel : info.channels) {
    is_plain = is_plain && channel.value_offset == 0 && channel.value_scale == 1;
  }
  if (!is_plain || count < 2) {
    failData("{}: --channels color: {} channel{} of {} {} no colour, which is 2 to 4 of u8 or u16", info.name, count,
             count == 1 ? "" : "s", voxelTypeName(info.type), count == 1 ? "is" : "are");
  }
  if (!options.channel_names.empty()) failData("{}: channel-names: a colour has no channels", info.name);
  const SampleFormat format{.type = info.type == VoxelType::u8 ? SampleType::u8 : SampleType::u16, .channels = count};
  VoxelConverter converter(format, options.density, info.name);
  return std::make_unique<ColorSource>(std::move(channels), std::move(converter));
}

}  // namespace blockwalk
