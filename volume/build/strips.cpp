// SPDX-License-Identifier: Apache-2.0
#include "volume/build/strips.h"

#include <algorithm>
#include <cstring>

namespace blockwalk {
namespace {

constexpr std::uint64_t kGroupBytes = std::uint64_t{1} << 20;  // asked of the source at once

std::uint64_t slabBytes(const SourceInfo& info, int side) {
  return static_cast<std::uint64_t>(std::min(side, info.dims.z)) * static_cast<std::uint64_t>(info.dims.y) *
         channelRowBytes(info) * info.channels.size();
}

// As many whole strips as kGroupBytes hold, at least one.
int groupRows(const SourceInfo& info, int side) {
  const std::uint64_t strip_slice = static_cast<std::uint64_t>(side) * channelRowBytes(info) * info.channels.size();
  const std::uint64_t strips = std::max<std::uint64_t>(1, kGroupBytes / strip_slice);
  const auto all = static_cast<std::uint64_t>((info.dims.y + side - 1) / side);
  return static_cast<int>(std::min(strips, all)) * side;
}

}  // namespace

StripReader::StripReader(Source& source, int side, std::uint64_t slab_bytes, const std::filesystem::path& folder)
    : source_(source),
      dims_(source.info().dims),
      channels_(source.info().channels.size()),
      side_(side),
      row_bytes_(channelRowBytes(source.info())),
      group_rows_(groupRows(source.info(), side)),
      // One strip a slab asks for whole slices in order, which every source can give.
      direct_(source.info().random_access || dims_.y <= side),
      slab_(folder, slabBytes(source.info(), side) <= slab_bytes
                        ? static_cast<std::size_t>(slabBytes(source.info(), side))
                        : static_cast<std::size_t>(std::min(kGroupBytes, slab_bytes))) {}

Strip StripReader::read(int z, int y, std::vector<std::byte>& voxels) {
  const glm::ivec3 begin(0, y * side_, z * side_);
  const glm::ivec3 extent(dims_.x, std::min(side_, dims_.y - begin.y), std::min(side_, dims_.z - begin.z));
  if (!direct_ && y == 0) collectSlab(z);
  const std::uint64_t part = static_cast<std::uint64_t>(extent.y) * row_bytes_;
  const auto slices = static_cast<std::size_t>(extent.z);
  voxels.resize(static_cast<std::size_t>(part) * slices * channels_);
  for (std::size_t slice = 0; slice < slices; ++slice) {
    if (direct_) {
      readDirect(begin.z + static_cast<int>(slice), begin.y, extent.y, slice, slices, voxels);
    } else {
      readSlab(begin.y, extent.y, slice, slices, voxels);
    }
  }
  return {.begin = begin, .extent = extent, .channels = channels_, .voxels = voxels};
}

void StripReader::readDirect(int z, int y, int rows, std::size_t slice, std::size_t slices,
                             std::span<std::byte> strip) {
  const std::size_t part = static_cast<std::size_t>(rows) * row_bytes_;
  if (channels_ == 1) {
    source_.readRows(z, y, rows, strip.subspan(slice * part, part));
    return;
  }
  rows_.resize(part * channels_);
  source_.readRows(z, y, rows, rows_);
  for (std::size_t channel = 0; channel < channels_; ++channel) {
    std::memcpy(strip.data() + (channel * slices + slice) * part, rows_.data() + channel * part, part);
  }
}

// A slab holds slice after slice, in a slice group after group, and of a group what the source gave.
void StripReader::readSlab(int y, int rows, std::size_t slice, std::size_t slices, std::span<std::byte> strip) const {
  const std::size_t part = static_cast<std::size_t>(rows) * row_bytes_;
  const int group = y / group_rows_ * group_rows_;
  const auto rows_in_group = static_cast<std::uint64_t>(std::min(group_rows_, dims_.y - group));
  const std::uint64_t before =
      (slice * static_cast<std::uint64_t>(dims_.y) + static_cast<std::uint64_t>(group)) * channels_;
  for (std::size_t channel = 0; channel < channels_; ++channel) {
    const std::uint64_t row = before + channel * rows_in_group + static_cast<std::uint64_t>(y - group);
    slab_.read(row * row_bytes_, strip.subspan((channel * slices + slice) * part, part));
  }
}

void StripReader::collectSlab(int z) {
  slab_.clear();
  const int end = std::min((z + 1) * side_, dims_.z);
  for (int slice = z * side_; slice < end; ++slice) {
    for (int y = 0; y < dims_.y; y += group_rows_) {
      const int count = std::min(group_rows_, dims_.y - y);
      rows_.resize(static_cast<std::size_t>(count) * row_bytes_ * channels_);
      source_.readRows(slice, y, count, rows_);
      slab_.append(rows_);
    }
  }
}

}  // namespace blockwalk
