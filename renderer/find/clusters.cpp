// SPDX-License-Identifier: Apache-2.0
#include "renderer/find/clusters.h"

#include <algorithm>

#include "shaders/kernel_interface.h"
#include "volume/error.h"

namespace blockwalk {
namespace {

// The active macrocells that are in no box yet.
class Pool {
 public:
  Pool(std::vector<std::uint8_t> states, glm::ivec3 dims) : states_(std::move(states)), dims_(dims) {}

  bool holds(const MacrocellBox& box) const {
    return everyRow(box, [this](std::size_t first, std::size_t count) {
      return std::all_of(states_.begin() + static_cast<std::ptrdiff_t>(first),
                         states_.begin() + static_cast<std::ptrdiff_t>(first + count),
                         [](std::uint8_t state) { return state == gpu::kMacrocellActive; });
    });
  }

  void take(const MacrocellBox& box) {
    everyRow(box, [this](std::size_t first, std::size_t count) {
      std::fill_n(states_.begin() + static_cast<std::ptrdiff_t>(first), count, std::uint8_t{gpu::kMacrocellCalm});
      return true;
    });
  }

 private:
  template <typename Row>
  bool everyRow(const MacrocellBox& box, Row row) const {
    for (int z = box.lo.z; z < box.hi.z; ++z) {
      for (int y = box.lo.y; y < box.hi.y; ++y) {
        const std::size_t first =
            (static_cast<std::size_t>(z) * static_cast<std::size_t>(dims_.y) + static_cast<std::size_t>(y)) *
                static_cast<std::size_t>(dims_.x) +
            static_cast<std::size_t>(box.lo.x);
        if (!row(first, static_cast<std::size_t>(box.hi.x - box.lo.x))) return false;
      }
    }
    return true;
  }

  std::vector<std::uint8_t> states_;
  glm::ivec3 dims_;
};

MacrocellBox grow(const Pool& pool, MacrocellBox box, glm::ivec3 dims) {
  for (int axis = 0; axis < 3; ++axis) {
    while (box.hi[axis] < dims[axis]) {
      MacrocellBox next = box;
      next.lo[axis] = box.hi[axis];
      next.hi[axis] = box.hi[axis] + 1;
      if (!pool.holds(next)) break;
      box.hi[axis] += 1;
    }
  }
  return box;
}

}  // namespace

std::vector<MacrocellBox> mergeMacrocells(std::vector<std::uint8_t> states, glm::ivec3 dims) {
  const auto macrocells =
      static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z);
  BLOCKWALK_CHECK(states.size(), ==, macrocells);
  Pool pool(std::move(states), dims);
  std::vector<MacrocellBox> boxes;
  for (int z = 0; z < dims.z; ++z) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x) {
        const MacrocellBox macrocell{.lo = {x, y, z}, .hi = {x + 1, y + 1, z + 1}};
        if (!pool.holds(macrocell)) continue;
        boxes.push_back(grow(pool, macrocell, dims));
        pool.take(boxes.back());
      }
    }
  }
  return boxes;
}

}  // namespace blockwalk
