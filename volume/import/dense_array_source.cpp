// SPDX-License-Identifier: Apache-2.0
#include "volume/import/dense_array_source.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/convert/channel.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kPieceBytes = std::uint64_t{1} << 20;

class SampleArray final : public Source {
 public:
  SampleArray(SourceInfo info, ChannelConverter converter, ArrayOrder order, std::shared_ptr<ByteReader> bytes)
      : info_(std::move(info)), converter_(std::move(converter)), order_(order), bytes_(std::move(bytes)) {
    info_.random_access = bytes_->randomAccess();
  }

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }
  std::unique_ptr<Source> another() const override {
    if (!info_.random_access) return nullptr;
    return std::make_unique<SampleArray>(info_, converter_.anew(), order_, bytes_);
  }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const auto width = static_cast<std::uint64_t>(info_.dims.x);
    const auto rows = static_cast<std::uint64_t>(info_.dims.y);
    const std::uint64_t first = (static_cast<std::uint64_t>(z) * rows + static_cast<std::uint64_t>(y)) * width;
    const std::uint64_t voxels = width * static_cast<std::uint64_t>(count);
    BLOCKWALK_CHECK(out.size(), ==, voxels * voxelBytes(info_.type) * info_.channels.size());
    if (order_ == ArrayOrder::voxels) {
      readRun(first, voxels,
              [&](std::span<std::byte> samples, std::uint64_t done) { converter_.convert(samples, done, out); });
      return;
    }
    const std::uint64_t plane = width * rows * static_cast<std::uint64_t>(info_.dims.z);
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      readRun(channel * plane + first, voxels, [&](std::span<std::byte> samples, std::uint64_t done) {
        converter_.convertPlane(channel, samples, done, out);
      });
    }
  }

 private:
  // Calls convert(samples, done) for pieces of `count` voxels of the file from `first` on.
  template <typename Convert>
  void readRun(std::uint64_t first, std::uint64_t count, Convert convert) {
    const std::size_t file_voxel = converter_.format().voxelBytes();
    const std::uint64_t piece = kPieceBytes / file_voxel;
    samples_.resize(std::min(piece, count) * file_voxel);
    for (std::uint64_t done = 0; done < count; done += piece) {
      const auto samples = std::span(samples_).first(std::min(piece, count - done) * file_voxel);
      bytes_->read((first + done) * file_voxel, samples);
      convert(samples, done);
    }
  }

  SourceInfo info_;
  ChannelConverter converter_;
  ArrayOrder order_;
  std::shared_ptr<ByteReader> bytes_;
  std::vector<std::byte> samples_;
};

// Values of `said` are maps from samples, those of `channel` so far the way from stored values to samples.
void describeAs(const SourceChannel& said, bool has_name, SourceChannel& channel) {
  if (has_name) channel.name = said.name;
  if (!said.unit.empty()) channel.unit = said.unit;
  channel.color = said.color;
  channel.value_offset = said.value_offset + said.value_scale * channel.value_offset;
  channel.value_scale *= said.value_scale;
}

}  // namespace

std::unique_ptr<Source> makeSampleArray(SampleArrayInfo array, const ImportOptions& options,
                                        std::unique_ptr<ByteReader> bytes) {
  SourceInfo info = std::move(array.info);
  const auto describe = [&](const ChannelConverter& converter) {
    converter.describe(info, options);
    for (SourceChannel& channel : info.channels) channel.unit = array.unit;
    if (array.channels.size() != info.channels.size()) return;
    const bool has_names = info.channels.size() > 1 && options.channel_names.empty();
    for (std::size_t i = 0; i < info.channels.size(); ++i) describeAs(array.channels[i], has_names, info.channels[i]);
  };
  if (array.order == ArrayOrder::planes && array.format.channels > 1) {
    if (!bytes->randomAccess()) {
      failData(
          "{}: channels: they lie one after the other in compressed data, which cannot be read so; unpack it first",
          info.name);
    }
    SampleFormat one = array.format;
    one.channels = 1;
    auto converter =
        ChannelConverter::ofPlanes(one, static_cast<std::size_t>(array.format.channels), options, info.name);
    describe(converter);
    return std::make_unique<SampleArray>(std::move(info), std::move(converter), ArrayOrder::planes, std::move(bytes));
  }
  ChannelConverter converter(array.format, array.is_color, options, info.name);
  describe(converter);
  return std::make_unique<SampleArray>(std::move(info), std::move(converter), ArrayOrder::voxels, std::move(bytes));
}

}  // namespace blockwalk
