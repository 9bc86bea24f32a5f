// SPDX-License-Identifier: Apache-2.0
#include "volume/file/steps.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "volume/error.h"
#include "volume/file/channel.h"
#include "volume/file/checksum.h"
#include "volume/file/header.h"

namespace blockwalk {
namespace {

constexpr std::size_t kChecksumOffset = offsetof(StepsHeader, header_checksum);
constexpr std::uint64_t kMostVoxels = std::uint64_t{1} << 48;  // of a step

std::uint64_t stepsChecksum(std::span<const std::byte> header) {
  std::vector<std::byte> copy(header.begin(), header.end());
  std::memset(copy.data() + kChecksumOffset, 0, sizeof(std::uint64_t));
  return checksumOf(copy);
}

std::uint64_t aligned(std::uint64_t offset) { return (offset + kStepAlignment - 1) / kStepAlignment * kStepAlignment; }

#define STEPS_FIELD(name) #name, offsetof(StepsHeader, name), header.name

StepsHeader stepsHeaderOf(std::span<const std::byte> start, std::uint64_t file_bytes, const std::string& file) {
  if (start.size() < sizeof(StepsHeader)) {
    failData("{}: {} bytes, but the header of steps in time alone has {}", file, file_bytes, sizeof(StepsHeader));
  }
  StepsHeader header;
  std::memcpy(&header, start.data(), sizeof header);
  return header;
}

bool haveOneMap(const ChannelInfo& a, const ChannelInfo& b) {
  return a.value_scale == b.value_scale && a.value_offset == b.value_offset;
}

// What differs less, of a voxel's length, is one place written in other digits.
constexpr double kSamePlace = 1e-4;

// A density of a channel, in the map of another; where that is between two floats, the one below or above.
float inMap(const ChannelInfo& from, const ChannelInfo& to, float stored, float towards) {
  if (haveOneMap(from, to)) return stored;
  const double exact = to.storedFromData(from.dataFromStored(static_cast<double>(stored)));
  const auto nearest = static_cast<float>(exact);
  const bool is_outside = towards < 0 ? static_cast<double>(nearest) <= exact : static_cast<double>(nearest) >= exact;
  return is_outside ? nearest : std::nextafter(nearest, towards);
}
constexpr float kDown = -std::numeric_limits<float>::infinity();
constexpr float kUp = std::numeric_limits<float>::infinity();

// Adds bins over [lo, hi] to those of `all`: where one lies across several, its count is spread evenly, and none is
// lost.
void addBins(const std::array<std::uint64_t, kHistogramBins>& bins, double lo, double hi, ChannelInfo& all) {
  const double all_lo = static_cast<double>(all.histogram_lo);
  const double all_width = (static_cast<double>(all.histogram_hi) - all_lo) / kHistogramBins;
  const double width = (hi - lo) / kHistogramBins;
  const auto last = static_cast<double>(kHistogramBins - 1);
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (bins[i] == 0) continue;
    const double begin = lo + width * static_cast<double>(i);
    if (!(all_width > 0) || !(width > 0)) {
      const double at = all_width > 0 ? std::clamp(std::floor((begin - all_lo) / all_width), 0.0, last) : 0.0;
      all.histogram[static_cast<std::size_t>(at)] += bins[i];
      continue;
    }
    const double first = std::clamp((begin - all_lo) / all_width, 0.0, last);
    const double end = std::clamp((begin + width - all_lo) / all_width, first, last + 1);
    std::uint64_t spread = 0;
    for (auto bin = static_cast<std::size_t>(first); bin < kHistogramBins; ++bin) {
      const double share = end > first ? (static_cast<double>(bin + 1) - first) / (end - first) : 1.0;
      const auto up_to = share >= 1 - 1e-9 || bin + 1 == kHistogramBins
                             ? bins[i]
                             : static_cast<std::uint64_t>(share * static_cast<double>(bins[i]));
      all.histogram[bin] += up_to - spread;
      spread = up_to;
      if (spread == bins[i]) break;
    }
  }
}

}  // namespace

bool areOnePlace(const glm::dmat4& a, const glm::dmat4& b, glm::ivec3 dims) {
  const glm::dvec3 far(dims);
  for (const glm::dvec3& corner :
       {glm::dvec3(0), glm::dvec3(far.x, 0, 0), glm::dvec3(0, far.y, 0), glm::dvec3(0, 0, far.z)}) {
    const glm::dvec3 apart(glm::inverse(a) * (b * glm::dvec4(corner, 1)) - glm::dvec4(corner, 1));
    if (!(glm::length(apart) <= kSamePlace)) return false;
  }
  return true;
}

bool beginsSteps(std::span<const std::byte> start) {
  return start.size() >= kStepsMagic.size() && std::memcmp(start.data(), kStepsMagic.data(), kStepsMagic.size()) == 0;
}

std::size_t stepsHeaderBytes(std::size_t steps, std::size_t channels) {
  return sizeof(StepsHeader) + steps * sizeof(StepPlace) + channels * sizeof(ChannelEntry);
}

std::vector<std::byte> encodeSteps(const Steps& steps, std::uint64_t file_bytes) {
  std::vector<std::byte> bytes(stepsHeaderBytes(steps.places.size(), steps.channels.size()));
  const StepsHeader header{.magic = kStepsMagic,
                           .version = kFileVersion,
                           .header_bytes = static_cast<std::uint32_t>(bytes.size()),
                           .file_bytes = file_bytes,
                           .step_count = static_cast<std::uint32_t>(steps.places.size()),
                           .channel_count = static_cast<std::uint32_t>(steps.channels.size()),
                           .type = static_cast<std::uint8_t>(steps.type)};
  std::memcpy(bytes.data(), &header, sizeof header);
  std::byte* end = bytes.data() + sizeof header;
  for (const StepPlace& place : steps.places) {
    std::memcpy(end, &place, sizeof place);
    end += sizeof place;
  }
  for (const ChannelInfo& channel : steps.channels) {
    const ChannelEntry entry = entryOf(channel);
    std::memcpy(end, &entry, sizeof entry);
    end += sizeof entry;
  }
  const std::uint64_t checksum = stepsChecksum(bytes);
  std::memcpy(bytes.data() + kChecksumOffset, &checksum, sizeof checksum);
  return bytes;
}

std::size_t stepsHeaderBytes(std::span<const std::byte> start, std::uint64_t file_bytes, const std::string& file) {
  const FieldCheck check{file};
  const StepsHeader header = stepsHeaderOf(start, file_bytes, file);
  check(header.version == kFileVersion, STEPS_FIELD(version), fmt::format("{} for this program", kFileVersion));
  check(header.file_bytes == file_bytes, STEPS_FIELD(file_bytes), fmt::format("the file's length, {}", file_bytes));
  check(header.step_count >= 1 && header.step_count <= kMaxSteps, STEPS_FIELD(step_count),
        fmt::format("1..{}", kMaxSteps));
  check(header.type >= 1 && header.type <= 4, STEPS_FIELD(type), "1 (rgba8), 2 (u8), 3 (u16) or 4 (f32)");
  const bool color = static_cast<VoxelType>(header.type) == VoxelType::rgba8;
  check(header.channel_count >= 1 && header.channel_count <= (color ? 1 : kMaxChannels), STEPS_FIELD(channel_count),
        color ? "1 for rgba8" : "1..4");
  const std::size_t bytes = stepsHeaderBytes(header.step_count, header.channel_count);
  check(header.header_bytes == bytes, STEPS_FIELD(header_bytes), fmt::format("{} for these counts", bytes));
  check(header.header_bytes <= file_bytes, STEPS_FIELD(header_bytes), "at most the file's length");
  return bytes;
}

Steps decodeSteps(std::span<const std::byte> bytes, std::uint64_t file_bytes, const std::string& file) {
  const FieldCheck check{file};
  BLOCKWALK_CHECK(bytes.size(), ==, stepsHeaderBytes(bytes, file_bytes, file));
  const StepsHeader header = stepsHeaderOf(bytes, file_bytes, file);
  const std::uint64_t checksum = stepsChecksum(bytes);
  check(checksum == header.header_checksum, STEPS_FIELD(header_checksum),
        fmt::format("{}, the header's own", checksum));
  for (std::size_t i = 0; i < header.reserved.size(); ++i) {
    check(header.reserved[i] == 0, "reserved", offsetof(StepsHeader, reserved) + i, header.reserved[i], "0");
  }
  Steps steps{.type = static_cast<VoxelType>(header.type), .places = {}, .channels = {}};
  std::uint64_t end = bytes.size();
  for (std::size_t i = 0; i < header.step_count; ++i) {
    StepPlace place;
    const std::size_t at = sizeof header + i * sizeof place;
    std::memcpy(&place, bytes.data() + at, sizeof place);
    check(place.offset == aligned(end), fmt::format("step {} offset", i), at, place.offset,
          fmt::format("{}, the next multiple of {}", aligned(end), kStepAlignment));
    check(place.offset <= file_bytes && place.bytes <= file_bytes - place.offset, fmt::format("step {} bytes", i),
          at + offsetof(StepPlace, bytes), place.bytes, "at most what the file has from its offset on");
    end = place.offset + place.bytes;
    steps.places.push_back(place);
  }
  check(end == file_bytes, STEPS_FIELD(file_bytes), fmt::format("{}, the end of the last step", end));
  const std::size_t entries = sizeof header + header.step_count * sizeof(StepPlace);
  for (std::size_t i = 0; i < header.channel_count; ++i) {
    ChannelEntry entry;
    const std::size_t at = entries + i * sizeof entry;
    std::memcpy(&entry, bytes.data() + at, sizeof entry);
    checkChannel(entry, {.offset = at, .prefix = fmt::format("all steps channel {} ", i)}, steps.type,
                 kMostVoxels * header.step_count, check);
    steps.channels.push_back(channelOf(entry));
  }
  return steps;
}

ChannelInfo overAllSteps(std::span<const ChannelInfo> steps) {
  ChannelInfo all = steps.front();
  all.nonempty_voxels = 0;
  all.nonfinite_voxels = 0;
  all.histogram = {};
  bool is_first = true;
  for (const ChannelInfo& step : steps) {
    all.empty_threshold = std::min(all.empty_threshold, inMap(step, all, step.empty_threshold, kDown));
    all.nonempty_voxels += step.nonempty_voxels;
    all.nonfinite_voxels += step.nonfinite_voxels;
    all.largest_rounding = std::max(all.largest_rounding, step.largest_rounding);
    if (step.nonempty_voxels == 0) continue;
    const auto widen = [&](float& lo, float& hi, float step_lo, float step_hi) {
      const float lower = inMap(step, all, step_lo, kDown);
      const float upper = inMap(step, all, step_hi, kUp);
      lo = is_first ? lower : std::min(lo, lower);
      hi = is_first ? upper : std::max(hi, upper);
    };
    widen(all.density_min, all.density_max, step.density_min, step.density_max);
    widen(all.histogram_lo, all.histogram_hi, step.histogram_lo, step.histogram_hi);
    is_first = false;
  }
  for (const ChannelInfo& step : steps) {
    const auto inAll = [&](float bound) { return all.storedFromData(step.dataFromStored(static_cast<double>(bound))); };
    addBins(step.histogram, inAll(step.histogram_lo), inAll(step.histogram_hi), all);
  }
  return all;
}

void showAllSteps(const Steps& steps, VolumeInfo& info, const std::string& file) {
  if (info.type != steps.type || info.channels.size() != steps.channels.size()) {
    failData("{}: has {} channels of {}, the steps together {} of {}", file, info.channels.size(),
             voxelTypeName(info.type), steps.channels.size(), voxelTypeName(steps.type));
  }
  info.steps = static_cast<int>(steps.places.size());
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    const ChannelInfo& all = steps.channels[i];
    ChannelInfo& channel = info.channels[i];
    channel.density_min = inMap(all, channel, all.density_min, kDown);
    channel.density_max = inMap(all, channel, all.density_max, kUp);
    channel.histogram_lo = inMap(all, channel, all.histogram_lo, kDown);
    channel.histogram_hi = inMap(all, channel, all.histogram_hi, kUp);
    channel.histogram = all.histogram;
    for (const float bound : {channel.density_min, channel.density_max, channel.histogram_lo, channel.histogram_hi}) {
      if (!std::isfinite(bound))
        failData("{}: channel {}: densities of all steps are beyond its map of values", file, i);
    }
  }
}

}  // namespace blockwalk
