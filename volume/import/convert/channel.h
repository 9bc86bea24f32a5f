// SPDX-License-Identifier: Apache-2.0
// What the samples of a voxel become: one colour, or a channel each.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "volume/import/convert/sample.h"
#include "volume/import/convert/voxel.h"
#include "volume/import/import.h"
#include "volume/source.h"

namespace blockwalk {

class ChannelConverter {
 public:
  // `is_color`: what several samples a voxel are where `options` leave it open. Throws DataError, naming `source`, for
  // more than kMaxChannels and for what VoxelConverter refuses.
  ChannelConverter(const SampleFormat& format, bool is_color, const ImportOptions& options, const std::string& source);
  // `channels` fields of `format`, which is a single sample: what lies in planes or pages of its own.
  static ChannelConverter ofPlanes(const SampleFormat& format, std::size_t channels, const ImportOptions& options,
                                   const std::string& source);

  // The same, which has converted nothing so far.
  ChannelConverter anew() const;
  // Sets type and channels, with the names that the options give. Throws DataError when they are not one a channel.
  void describe(SourceInfo& info, const ImportOptions& options) const;
  std::size_t channels() const { return converters_.size(); }
  // What the file's voxel is: of planes, one sample.
  const SampleFormat& format() const { return format_; }
  ConversionReport report(std::size_t channel) const { return converters_[channel].report(); }

  // `samples` holds whole voxels, which are voxels `first` and on of `rows`: the bytes of Source::readRows().
  void convert(std::span<std::byte> samples, std::size_t first, std::span<std::byte> rows);
  // The same of one channel alone.
  void convertPlane(std::size_t channel, std::span<std::byte> samples, std::size_t first, std::span<std::byte> rows);

 private:
  ChannelConverter(const SampleFormat& format, std::vector<VoxelConverter> converters)
      : format_(format), converters_(std::move(converters)) {}

  SampleFormat format_;
  std::vector<VoxelConverter> converters_;  // by channel
  std::vector<std::byte> plane_;
};

// Names the channels of `info` as the options say; leaves them where the options say nothing.
void nameChannels(SourceInfo& info, const ImportOptions& options);

// Takes what a file says of a channel. Values of `said` are maps from samples, those of `channel` so far the way from
// stored values to samples.
void describeAs(const SourceChannel& said, bool has_name, SourceChannel& channel);

}  // namespace blockwalk
