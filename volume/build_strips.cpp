// SPDX-License-Identifier: Apache-2.0
#include "volume/build_strips.h"

#include <algorithm>

namespace blockwalk {
namespace {

constexpr std::uint64_t kGroupBytes = std::uint64_t{1} << 20;  // asked of the source at once

std::uint64_t slabBytes(const SourceInfo& info, int side) {
  return static_cast<std::uint64_t>(std::min(side, info.dims.z)) * static_cast<std::uint64_t>(info.dims.y) *
         static_cast<std::uint64_t>(info.dims.x) * voxelBytes(info.type);
}

}  // namespace

StripReader::StripReader(Source& source, int side, std::uint64_t slab_bytes, const std::filesystem::path& folder)
    : source_(source),
      dims_(source.info().dims),
      side_(side),
      row_bytes_(static_cast<std::uint64_t>(dims_.x) * voxelBytes(source.info().type)),
      // One strip a slab asks for whole slices in order, which every source can give.
      direct_(source.info().random_access || dims_.y <= side),
      slab_(folder, slabBytes(source.info(), side) <= slab_bytes
                        ? static_cast<std::size_t>(slabBytes(source.info(), side))
                        : static_cast<std::size_t>(std::min(kGroupBytes, slab_bytes))) {}

Strip StripReader::read(int z, int y) {
  const glm::ivec3 begin(0, y * side_, z * side_);
  const glm::ivec3 extent(dims_.x, std::min(side_, dims_.y - begin.y), std::min(side_, dims_.z - begin.z));
  if (!direct_ && y == 0) collectSlab(z);
  const std::uint64_t part = static_cast<std::uint64_t>(extent.y) * row_bytes_;
  strip_.resize(static_cast<std::size_t>(part * static_cast<std::uint64_t>(extent.z)));
  for (int slice = 0; slice < extent.z; ++slice) {
    const std::span<std::byte> out = std::span(strip_).subspan(static_cast<std::size_t>(slice) * part, part);
    if (direct_) {
      source_.readRows(begin.z + slice, begin.y, extent.y, out);
    } else {
      slab_.read(static_cast<std::uint64_t>(slice * std::int64_t{dims_.y} + begin.y) * row_bytes_, out);
    }
  }
  return {.extent = extent, .voxels = strip_};
}

void StripReader::collectSlab(int z) {
  slab_.clear();
  const int rows =
      static_cast<int>(std::clamp<std::uint64_t>(kGroupBytes / row_bytes_, 1, static_cast<std::uint64_t>(dims_.y)));
  const int end = std::min((z + 1) * side_, dims_.z);
  for (int slice = z * side_; slice < end; ++slice) {
    for (int y = 0; y < dims_.y; y += rows) {
      const int count = std::min(rows, dims_.y - y);
      rows_.resize(static_cast<std::size_t>(count) * row_bytes_);
      source_.readRows(slice, y, count, rows_);
      slab_.append(rows_);
    }
  }
}

}  // namespace blockwalk
