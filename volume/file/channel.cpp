// SPDX-License-Identifier: Apache-2.0
#include "volume/file/channel.h"

#include <cmath>
#include <cstring>

#include "volume/plain_text.h"

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

void checkChannelFields(const ChannelFields& fields, const ChannelPlace& place, std::uint64_t voxels,
                        const FieldCheck& check) {
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
}

void checkChannelName(const ChannelEntry& entry, const ChannelPlace& place, const FieldCheck& check) {
  check(entry.name_bytes <= kMaxChannelNameBytes, place.name("name_bytes"),
        place.offset + offsetof(ChannelEntry, name_bytes), entry.name_bytes, "at most 64");
  check(entry.reserved == 0, place.name("reserved"), place.offset + offsetof(ChannelEntry, reserved), entry.reserved,
        "0");
  const std::string_view name(entry.name.data(), entry.name_bytes);
  if (!isPlainText(name)) {
    failData("{}: {} at offset {} is not UTF-8 without control characters", check.file, place.name("name"),
             place.offset + offsetof(ChannelEntry, name));
  }
  for (std::size_t i = entry.name_bytes; i < entry.name.size(); ++i) {
    check(entry.name[i] == 0, place.name("name"), place.offset + offsetof(ChannelEntry, name) + i,
          static_cast<int>(entry.name[i]), "0 behind the name");
  }
}

ChannelInfo channelOf(const ChannelFields& fields) {
  return {.name = {},
          .value_scale = fields.value_scale,
          .value_offset = fields.value_offset,
          .empty_threshold = fields.empty_threshold,
          .density_min = fields.density_min,
          .density_max = fields.density_max,
          .bin_cuts = fields.bin_cuts,
          .histogram_lo = fields.histogram_lo,
          .histogram_hi = fields.histogram_hi,
          .histogram = fields.histogram,
          .nonempty_voxels = fields.nonempty_voxels,
          .nonfinite_voxels = fields.nonfinite_voxels,
          .largest_rounding = fields.largest_rounding};
}

ChannelFields fieldsOf(const ChannelInfo& channel) {
  return {.value_scale = channel.value_scale,
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
          .histogram = channel.histogram};
}

ChannelEntry entryOf(const ChannelInfo& channel) {
  ChannelEntry entry;
  entry.fields = fieldsOf(channel);
  entry.name_bytes = static_cast<std::uint32_t>(channel.name.size());
  std::memcpy(entry.name.data(), channel.name.data(), channel.name.size());
  return entry;
}

}  // namespace blockwalk
