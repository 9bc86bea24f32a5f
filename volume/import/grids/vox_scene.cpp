// SPDX-License-Identifier: Apache-2.0
#include "volume/import/grids/vox_scene.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>

#include "volume/error.h"
#include "volume/import/geometry.h"
#include "volume/import/grids/vox_chunks.h"
#include "volume/import/header_text.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

constexpr int kMostDepth = 64;
constexpr std::size_t kMostVisits = std::size_t{1} << 20;  // of nodes, which may be used over and over
constexpr std::uint64_t kPlacedBytes = 40;                 // of a voxel while voxels are sorted

// Where a model lies: a rotation by quarter turns and mirrors, and an offset; whole numbers, far below 2^53.
struct VoxPlace {
  glm::dmat3 turn{1};
  glm::dvec3 offset{0};
};

VoxPlace operator*(const VoxPlace& outer, const VoxPlace& inner) {
  return {outer.turn * inner.turn, outer.turn * inner.offset + outer.offset};
}

// Row i of the matrix has its one number in the column that bits say, and a sign.
glm::dmat3 turnOf(const VoxChunks& chunks, std::int64_t bits) {
  const auto first = static_cast<int>(bits & 3);
  const auto second = static_cast<int>(bits >> 2 & 3);
  if (first > 2 || second > 2 || first == second) {
    chunks.fail("nTRN", fmt::format("_r: {} is no rotation", bits));
  }
  const std::array<int, 3> columns{first, second, 3 - first - second};
  glm::dmat3 turn{0};
  for (int row = 0; row < 3; ++row)
    turn[columns[static_cast<std::size_t>(row)]][row] = (bits >> (4 + row) & 1) != 0 ? -1 : 1;
  return turn;
}

VoxPlace placeOf(const VoxChunks& chunks, const VoxDict& frame) {
  VoxPlace place;
  if (const auto turn = frame.find("_r"); turn != frame.end()) {
    place.turn = turnOf(chunks, parseInteger(turn->second).value_or(-1) & 0xffff);
  }
  const auto offset = frame.find("_t");
  if (offset == frame.end()) return place;
  const auto numbers = words(offset->second);
  for (int i = 0; i < 3; ++i) {
    const auto number = numbers.size() == 3 ? parseInteger(numbers[static_cast<std::size_t>(i)]) : std::nullopt;
    if (!number || *number < -(1 << 24) || *number > 1 << 24) {
      chunks.fail("nTRN", fmt::format("_t: '{}' must be three whole numbers", offset->second.substr(0, 40)));
    }
    place.offset[i] = *number;
  }
  return place;
}

// Models at places, in the order in which the scene has them.
class VoxPlacer {
 public:
  VoxPlacer(const VoxChunks& chunks, std::uint64_t memory_bytes)
      : chunks_(chunks), most_voxels_(memory_bytes / kPlacedBytes) {}

  void walk(std::int32_t id, const VoxPlace& place, int depth) {
    if (depth > kMostDepth) chunks_.fail("nTRN", fmt::format("nodes are nested more than {} times", kMostDepth));
    if (++visits_ > kMostVisits) chunks_.fail("nGRP", fmt::format("the scene has more than {} nodes", kMostVisits));
    const auto found = chunks_.nodes().find(id);
    if (found == chunks_.nodes().end()) chunks_.fail("nTRN", fmt::format("node {} is not there", id));
    const VoxNode& node = found->second;
    if (node.is_hidden || chunks_.hiddenLayers().contains(node.layer)) {
      has_hidden_ = true;
      return;
    }
    const VoxPlace inner = node.has_place ? place * placeOf(chunks_, node.frame) : place;
    for (const std::int32_t child : node.children) walk(child, inner, depth + 1);
    if (node.models.empty()) return;
    has_steps_ = has_steps_ || node.models.size() > 1;
    add(node.models.front(), inner);
  }

  void add(std::int32_t model, const VoxPlace& place) {
    if (model < 0 || static_cast<std::size_t>(model) >= chunks_.models().size()) {
      chunks_.fail("nSHP", fmt::format("model {} is asked for, there are {}", model, chunks_.models().size()));
    }
    voxels_ += chunks_.models()[static_cast<std::size_t>(model)].count;
    if (voxels_ > most_voxels_) {
      chunks_.fail("XYZI",
                   fmt::format("the scene has more than {} voxels, as many as --memory has room for", most_voxels_));
    }
    placed_.push_back({model, place});
  }

  bool hasHidden() const { return has_hidden_; }
  bool hasSteps() const { return has_steps_; }

  void fill(VoxScene& scene) const {
    glm::i64vec3 low(INT64_MAX);
    glm::i64vec3 high(INT64_MIN);
    for (const Placed& placed : placed_) {
      const VoxModel& model = modelOf(placed);
      for (const glm::ivec3& corner : {glm::ivec3(0), model.dims - 1}) {
        const glm::i64vec3 at = voxelOf(model, placed.place, corner);
        low = glm::min(low, at);
        high = glm::max(high, at);
      }
    }
    if (placed_.empty()) chunks_.fail("XYZI", "no model is shown");
    const glm::i64vec3 dims = high - low + std::int64_t{1};
    scene.dims = checkedDims(dims.x, dims.y, dims.z, chunks_.name(), "size of the scene");
    std::vector<std::uint64_t> voxels;  // places and then colours, so that the last of one place wins
    voxels.reserve(voxels_);
    std::vector<std::uint8_t> colors;
    colors.reserve(voxels_);
    for (const Placed& placed : placed_) {
      const VoxModel& model = modelOf(placed);
      for (std::size_t i = 0; i < model.count; ++i) {
        const std::array<std::uint8_t, 4> voxel = chunks_.voxel(model, i);
        const glm::ivec3 inside(voxel[0], voxel[1], voxel[2]);
        if (glm::any(glm::greaterThanEqual(inside, model.dims))) {
          chunks_.fail("XYZI", fmt::format("voxel {} at {},{},{} lies outside {} x {} x {}", i, inside.x, inside.y,
                                           inside.z, model.dims.x, model.dims.y, model.dims.z));
        }
        if (voxel[3] == 0) continue;
        const glm::u64vec3 at(voxelOf(model, placed.place, inside) - low);
        voxels.push_back((at.z * static_cast<std::uint64_t>(dims.y) + at.y) * static_cast<std::uint64_t>(dims.x) +
                         at.x);
        colors.push_back(voxel[3]);
      }
    }
    sort(voxels, colors, scene);
  }

 private:
  struct Placed {
    std::int32_t model = 0;
    VoxPlace place;
  };

  const VoxModel& modelOf(const Placed& placed) const {
    return chunks_.models()[static_cast<std::size_t>(placed.model)];
  }

  // Models turn about a corner of voxels, half of their size rounded down.
  static glm::i64vec3 voxelOf(const VoxModel& model, const VoxPlace& place, glm::ivec3 inside) {
    const glm::dvec3 center = glm::dvec3(inside - model.dims / 2) + 0.5;
    return glm::i64vec3(glm::floor(place.turn * center + place.offset));
  }

  static void sort(const std::vector<std::uint64_t>& voxels, const std::vector<std::uint8_t>& colors, VoxScene& scene) {
    std::vector<std::uint32_t> order(voxels.size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
      return voxels[a] != voxels[b] ? voxels[a] < voxels[b] : a < b;
    });
    scene.places.reserve(voxels.size());
    scene.colors.reserve(voxels.size());
    for (const std::uint32_t i : order) {
      if (!scene.places.empty() && scene.places.back() == voxels[i]) {
        scene.colors.back() = colors[i];
        continue;
      }
      scene.places.push_back(voxels[i]);
      scene.colors.push_back(colors[i]);
    }
  }

  const VoxChunks& chunks_;
  std::uint64_t most_voxels_;
  std::uint64_t voxels_ = 0;
  std::size_t visits_ = 0;
  bool has_hidden_ = false;
  bool has_steps_ = false;
  std::vector<Placed> placed_;
};

}  // namespace

VoxScene readVoxScene(const InputFile& file, std::int64_t step, std::uint64_t memory_bytes) {
  const VoxChunks chunks(file, memory_bytes / 4);
  VoxScene scene;
  scene.palette = chunks.palette();
  VoxPlacer placer(chunks, memory_bytes / 2);
  const bool is_scene = !chunks.nodes().empty();
  const std::size_t steps = is_scene ? 1 : chunks.models().size();
  if (static_cast<std::uint64_t>(step) >= steps) {
    failData("{}: frame {} is asked for, there are {}", file.name(), step, steps);
  }
  if (is_scene) {
    placer.walk(0, {}, 0);
  } else {
    placer.add(static_cast<std::int32_t>(step), {});
  }
  placer.fill(scene);
  if (steps > 1) {
    scene.notes.push_back(fmt::format("of the {} models it is number {}; --frame chooses", steps, step));
  }
  if (placer.hasHidden()) scene.notes.emplace_back("hidden parts of the scene are left out");
  if (placer.hasSteps()) scene.notes.emplace_back("of animated parts it is the first step");
  return scene;
}

}  // namespace blockwalk
