// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/dense_source.h"

#include <cmath>
#include <cstring>

#include "volume/error.h"

namespace blockwalk::reference {
namespace {

class DenseSource : public Source {
 public:
  explicit DenseSource(DenseVolume volume) : volume_(std::move(volume)) {
    BLOCKWALK_CHECK(volume_.level, ==, 0);
    info_ = {.name = "dense",
             .format = "demo",
             .type = volume_.type,
             .dims = volume_.dims,
             .world_from_index = volume_.world_from_index,
             .channels = {{.name = {}, .value_scale = volume_.value_scale, .value_offset = volume_.value_offset}},
             .random_access = true};
  }

  const SourceInfo& info() const override { return info_; }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const std::size_t voxel_bytes = voxelBytes(volume_.type);
    const auto voxels = static_cast<std::size_t>(count) * static_cast<std::size_t>(volume_.dims.x);
    BLOCKWALK_CHECK(out.size(), ==, voxels * voxel_bytes);
    const std::size_t first = volume_.at({0, y, z});
    for (std::size_t i = 0; i < voxels; ++i) write(first + i, out.data() + i * voxel_bytes);
  }

 private:
  void write(std::size_t voxel, std::byte* out) const {
    const float density = volume_.density[voxel];
    const float whole = std::isfinite(density) ? density : 0;
    if (volume_.type == VoxelType::f32) {
      std::memcpy(out, &density, sizeof density);
    } else if (volume_.type == VoxelType::u16) {
      const auto value = static_cast<std::uint16_t>(whole);
      std::memcpy(out, &value, sizeof value);
    } else if (volume_.type == VoxelType::u8) {
      *out = static_cast<std::byte>(whole);
    } else {
      std::memcpy(out, volume_.color[voxel].data(), 3);
      out[3] = static_cast<std::byte>(whole);
    }
  }

  DenseVolume volume_;
  SourceInfo info_;
};

}  // namespace

std::unique_ptr<Source> makeDenseSource(DenseVolume volume) { return std::make_unique<DenseSource>(std::move(volume)); }

}  // namespace blockwalk::reference
