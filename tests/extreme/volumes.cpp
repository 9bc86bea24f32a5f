// SPDX-License-Identifier: Apache-2.0
#include "tests/extreme/volumes.h"

#include <cstring>
#include <glm/gtc/matrix_transform.hpp>

#include "volume/error.h"

namespace blockwalk::extreme {
namespace {

class Filled : public Source {
 public:
  Filled(VoxelType type, glm::ivec3 dims, Density density, const glm::dmat4& world_from_index, ValueMap values)
      : density_(std::move(density)) {
    info_ = {.name = "extreme",
             .format = "demo",
             .type = type,
             .dims = dims,
             .world_from_index = world_from_index,
             .channels = {{.name = {}, .value_scale = values.scale, .value_offset = values.offset}},
             .random_access = true};
  }

  const SourceInfo& info() const override { return info_; }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    std::byte* next = out.data();
    for (int row = y; row < y + count; ++row) {
      for (int x = 0; x < info_.dims.x; ++x, next += voxelBytes(info_.type)) write(density_({x, row, z}), next);
    }
    BLOCKWALK_CHECK(next - out.data(), ==, static_cast<std::ptrdiff_t>(out.size()));
  }

 private:
  void write(float density, std::byte* out) const {
    switch (info_.type) {
      case VoxelType::rgba8:
        out[0] = out[1] = out[2] = std::byte{255};
        out[3] = static_cast<std::byte>(density);
        break;
      case VoxelType::u8:
        *out = static_cast<std::byte>(density);
        break;
      case VoxelType::u16: {
        const auto value = static_cast<std::uint16_t>(density);
        std::memcpy(out, &value, sizeof value);
        break;
      }
      case VoxelType::f32:
        std::memcpy(out, &density, sizeof density);
        break;
    }
  }

  SourceInfo info_;
  Density density_;
};

}  // namespace

glm::dmat4 spacing(glm::dvec3 voxel) { return glm::scale(glm::dmat4(1), voxel); }

std::shared_ptr<Source> fill(VoxelType type, glm::ivec3 dims, const Density& density,
                             const glm::dmat4& world_from_index, ValueMap values) {
  return std::make_shared<Filled>(type, dims, density, world_from_index, values);
}

double noise(glm::ivec3 voxel) {
  std::uint32_t state = 0x9e3779b9u;
  for (int axis = 0; axis < 3; ++axis) {
    state = (state ^ static_cast<std::uint32_t>(voxel[axis])) * 0x85ebca6bu;
    state ^= state >> 15;
    state *= 0xc2b2ae35u;
    state ^= state >> 13;
  }
  return static_cast<double>(state) / 4294967295.0;
}

std::shared_ptr<Source> clumps(VoxelType type, glm::ivec3 dims, const glm::dmat4& world_from_index) {
  return test::makeSynthetic({.type = type, .dims = dims, .seed = 7, .world_from_index = world_from_index});
}

View look(const glm::dmat4& world_from_index, glm::dvec3 eye, glm::dvec3 target, glm::dvec3 up) {
  View view;
  view.width = 24;
  view.height = 16;
  view.eye = glm::dvec3(world_from_index * glm::dvec4(eye, 1));
  view.target = glm::dvec3(world_from_index * glm::dvec4(target, 1));
  view.up = glm::dvec3(world_from_index * glm::dvec4(up, 0));
  view.background = {20, 60, 140, 255};
  return view;
}

View lookStraight(const glm::dmat4& world_from_index, glm::dvec3 eye, glm::dvec3 target, glm::dvec3 up, double pitch) {
  View view = look(world_from_index, eye, target, up);
  view.ortho_height = view.height * pitch * glm::length(*view.up) / glm::length(up);
  return view;
}

std::vector<TransferPoint> ramp(double lo, double hi, double opacity) {
  return {{.value = lo, .color = {0, 0, 0}, .opacity = 0}, {.value = hi, .color = {1, 1, 1}, .opacity = opacity}};
}

std::vector<TransferPoint> white(double opacity) { return {{.value = 0, .color = {1, 1, 1}, .opacity = opacity}}; }

}  // namespace blockwalk::extreme
