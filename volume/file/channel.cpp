// SPDX-License-Identifier: Apache-2.0
#include "volume/file/channel.h"

#include <cmath>

namespace blockwalk {
namespace {

#define CHANNEL_FIELD(field) place.name(#field), place.offset + offsetof(ChannelFields, field), fields.field

void checkRanges(const ChannelFields& fields, const ChannelPlace& place, const FieldCheck& check) {
  check(std::isfinite(fields.empty_threshold), CHANNEL_FIELD(empty_threshold), "finite");
  check(std::isfinite(fields.density_min), CHANNEL_FIELD(density_min), "finite");
  check(std::isfinite(fields.density_max) && fields.density_max >= fields.density_min, CHANNEL_FIELD(density_max),
        "finite and at least density_min");
  check(fields.nonempty_voxels == 0 || fields.density_min > fields.empty_threshold, CHANNEL_FIELD(density_min),
        "above empty_threshold");
  check(std::isfinite(fields.histogram_lo), CHANNEL_FIELD(histogram_lo), "finite");
  check(std::isfinite(fields.histogram_hi) && fields.histogram_hi >= fields.histogram_lo, CHANNEL_FIELD(histogram_hi),
        "finite and at least histogram_lo");
  for (std::size_t i = 0; i < fields.bin_cuts.size(); ++i) {
    const float before = i == 0 ? fields.bin_cuts[0] : fields.bin_cuts[i - 1];
    check(std::isfinite(fields.bin_cuts[i]) && fields.bin_cuts[i] >= before, place.name("bin_cuts"),
          place.offset + offsetof(ChannelFields, bin_cuts) + 4 * i, fields.bin_cuts[i], "finite and ascending");
  }
}

}  // namespace

void checkChannel(const ChannelEntry& entry, const ChannelPlace& place, VoxelType type, std::uint64_t voxels,
                  const FieldCheck& check) {
  const ChannelFields& fields = entry.fields;
  check(std::isfinite(fields.value_scale) && fields.value_scale > 0, CHANNEL_FIELD(value_scale), "finite and above 0");
  check(std::isfinite(fields.value_offset), CHANNEL_FIELD(value_offset), "finite");
  check(std::isfinite(fields.largest_rounding) && fields.largest_rounding >= 0, CHANNEL_FIELD(largest_rounding),
        "finite and at least 0");
  checkRanges(fields, place, check);
  check(fields.nonempty_voxels <= voxels, CHANNEL_FIELD(nonempty_voxels), "at most the number of voxels");
  check(fields.nonfinite_voxels <= voxels, CHANNEL_FIELD(nonfinite_voxels), "at most the number of voxels");
  std::uint64_t left = fields.nonempty_voxels;
  for (std::size_t i = 0; i < fields.histogram.size(); ++i) {
    check(fields.histogram[i] <= left, place.name("histogram"),
          place.offset + offsetof(ChannelFields, histogram) + 8 * i, fields.histogram[i],
          "such that all bins add up to nonempty_voxels");
    left -= fields.histogram[i];
  }
  check(left == 0, CHANNEL_FIELD(nonempty_voxels), "the sum of the histogram");
  const bool may_be_labels = type != VoxelType::rgba8;
  check(entry.values <= (may_be_labels ? 1 : 0), place.name("values"), place.offset + offsetof(ChannelEntry, values),
        entry.values, may_be_labels ? "0 (intensity) or 1 (labels)" : "0 (intensity) for rgba8");
  for (std::size_t i = 0; i < entry.reserved.size(); ++i) {
    check(entry.reserved[i] == 0, place.name("reserved"), place.offset + offsetof(ChannelEntry, reserved) + i,
          entry.reserved[i], "0");
  }
}

ChannelInfo channelOf(const ChannelEntry& entry) {
  const ChannelFields& fields = entry.fields;
  ChannelInfo channel;
  channel.values = static_cast<ChannelValues>(entry.values);
  channel.value_scale = fields.value_scale;
  channel.value_offset = fields.value_offset;
  channel.empty_threshold = fields.empty_threshold;
  channel.density_min = fields.density_min;
  channel.density_max = fields.density_max;
  channel.bin_cuts = fields.bin_cuts;
  channel.histogram_lo = fields.histogram_lo;
  channel.histogram_hi = fields.histogram_hi;
  channel.histogram = fields.histogram;
  channel.nonempty_voxels = fields.nonempty_voxels;
  channel.nonfinite_voxels = fields.nonfinite_voxels;
  channel.largest_rounding = fields.largest_rounding;
  return channel;
}

ChannelEntry entryOf(const ChannelInfo& channel) {
  return {.fields = {.value_scale = channel.value_scale,
                     .value_offset = channel.value_offset,
                     .largest_rounding = channel.largest_rounding,
                     .nonempty_voxels = channel.nonempty_voxels,
                     .nonfinite_voxels = channel.nonfinite_voxels,
                     .empty_threshold = channel.empty_threshold,
                     .density_min = channel.density_min,
                     .density_max = channel.density_max,
                     .histogram_lo = channel.histogram_lo,
                     .histogram_hi = channel.histogram_hi,
                     .bin_cuts = channel.bin_cuts,
                     .histogram = channel.histogram},
          .values = static_cast<std::uint8_t>(channel.values),
          .reserved = {}};
}

}  // namespace blockwalk
