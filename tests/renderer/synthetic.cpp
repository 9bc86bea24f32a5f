// SPDX-License-Identifier: Apache-2.0
#include "tests/renderer/synthetic.h"

#include <fmt/format.h>

#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <vector>

#include "volume/error.h"

namespace blockwalk::test {
namespace {

// A well-mixed 32-bit hash of a position.
std::uint32_t hash(glm::ivec3 position, std::uint32_t seed) {
  std::uint32_t state = seed * 0x9e3779b9u;
  for (int a = 0; a < 3; ++a) {
    state ^= static_cast<std::uint32_t>(position[a]);
    state *= 0x85ebca6bu;
    state ^= state >> 15;
    state *= 0xc2b2ae35u;
    state ^= state >> 13;
  }
  return state;
}

constexpr int kCell = 13;  // no multiple of a subblock's side

// 0 outside the clumps, else 1..255. One cell in three holds a ball or, rarer, a box; one voxel in 4000 stands alone.
std::uint32_t densityAt(glm::ivec3 voxel, std::uint32_t seed) {
  const std::uint32_t noise = hash(voxel, seed);
  if (noise % 4000 == 0) return 1 + noise / 4000 % 255;
  const std::uint32_t cell = hash(voxel / kCell, seed + 1);
  if (cell % 3 != 0) return 0;
  const glm::dvec3 local = glm::dvec3(voxel % kCell) + 0.5 - kCell / 2.0;
  const bool inside = cell % 9 == 0 || glm::length(local) < 3.0 + cell % 64 / 10.0;
  if (!inside || noise % 11 == 0) return 0;
  return 1 + (cell >> 8 & 127) + (noise >> 8 & 63) + (noise >> 16 & 63);
}

class Synthetic : public Source {
 public:
  explicit Synthetic(const SyntheticOptions& options) : seed_(options.seed), first_channel_(options.first_channel) {
    BLOCKWALK_CHECK(options.channels == 1 || options.type != VoxelType::rgba8, ==, true);
    info_ = {.name = "synthetic",
             .format = "demo",
             .type = options.type,
             .dims = options.dims,
             .world_from_index = options.world_from_index,
             .channels = std::vector<SourceChannel>(static_cast<std::size_t>(options.channels)),
             .random_access = true};
    for (int c = 0; c < options.channels; ++c) {
      SourceChannel& channel = info_.channels[static_cast<std::size_t>(c)];
      const int number = first_channel_ + c;
      channel.value_scale = (options.type == VoxelType::u16 ? 0.5 : 1) * (1 + number);
      channel.value_offset = options.type == VoxelType::u16 ? -100.0 : 0;
      if (options.channels > 1) channel.name = fmt::format("field {}", number);
    }
  }

  const SourceInfo& info() const override { return info_; }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const std::size_t voxel_bytes = voxelBytes(info_.type);
    const std::size_t channel_bytes = static_cast<std::size_t>(count * info_.dims.x) * voxel_bytes;
    BLOCKWALK_CHECK(out.size(), ==, info_.channels.size() * channel_bytes);
    std::byte* next = out.data();
    for (std::size_t c = 0; c < info_.channels.size(); ++c) {
      for (int row = y; row < y + count; ++row) {
        for (int x = 0; x < info_.dims.x; ++x, next += voxel_bytes) write({x, row, z}, fieldSeed(c), next);
      }
    }
  }

 private:
  std::uint32_t fieldSeed(std::size_t channel) const {
    return seed_ + 1000 * (static_cast<std::uint32_t>(first_channel_) + static_cast<std::uint32_t>(channel));
  }

  void write(glm::ivec3 voxel, std::uint32_t seed, std::byte* out) const {
    const std::uint32_t density = densityAt(voxel, seed);
    const std::uint32_t noise = hash(voxel, seed + 2);
    switch (info_.type) {
      case VoxelType::rgba8: {
        const std::uint32_t color = (hash(voxel / kCell, seed + 3) & 0xffffff) ^ (noise & 0x1f1f1f);
        const std::uint32_t rgba = color | density << 24;
        std::memcpy(out, &rgba, sizeof rgba);
        break;
      }
      case VoxelType::u8:
        *out = static_cast<std::byte>(density);
        break;
      case VoxelType::u16: {
        // The value map takes 0 to -100: the empty value is not zero in data units.
        const auto value = static_cast<std::uint16_t>(density * 16 + (density > 0 ? noise % 16 : 0));
        std::memcpy(out, &value, sizeof value);
        break;
      }
      case VoxelType::f32: {
        // Far above the empty 0, so that a coarser level's averages lie below the smallest density of level 0.
        float value =
            density == 0 ? 0.0f : 0.5f + static_cast<float>(density) / 256 + static_cast<float>(noise % 1024) / 262144;
        if (density > 0 && noise % 50 == 0) value = std::numeric_limits<float>::quiet_NaN();
        if (density > 0 && noise % 50 == 1) value = std::numeric_limits<float>::infinity();
        std::memcpy(out, &value, sizeof value);
        break;
      }
    }
  }

  SourceInfo info_;
  std::uint32_t seed_;
  int first_channel_;
};

class Voxels final : public Source {
 public:
  Voxels(glm::ivec3 dims, std::function<int(glm::ivec3)> density) : density_(std::move(density)) {
    info_.name = "voxels";
    info_.format = "test";
    info_.type = VoxelType::u8;
    info_.dims = dims;
    info_.random_access = true;
  }
  const SourceInfo& info() const override { return info_; }
  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    std::size_t at = 0;
    for (int row = y; row < y + count; ++row) {
      for (int x = 0; x < info_.dims.x; ++x) out[at++] = static_cast<std::byte>(density_({x, row, z}));
    }
  }

 private:
  std::function<int(glm::ivec3)> density_;
  SourceInfo info_;
};

}  // namespace

std::unique_ptr<Source> makeVoxels(glm::ivec3 dims, std::function<int(glm::ivec3)> density) {
  return std::make_unique<Voxels>(dims, std::move(density));
}

std::unique_ptr<Source> makeSynthetic(const SyntheticOptions& options) { return std::make_unique<Synthetic>(options); }

glm::dmat4 obliqueMap(bool mirrored) {
  glm::dmat4 map = glm::translate(glm::dmat4(1), {-40, 25, 7});
  map = glm::rotate(map, 0.8, glm::normalize(glm::dvec3(0.3, 1, -0.5)));
  return glm::scale(map, {mirrored ? -1.0 : 1.0, 1.3, 2.4});
}

}  // namespace blockwalk::test
