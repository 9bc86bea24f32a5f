// SPDX-License-Identifier: Apache-2.0
// `chip`: a circuit package without its mould: die, bond wires, traced copper layers, vias, solder balls, capacitors.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "volume/demo/capsules.h"
#include "volume/demo/model.h"
#include "volume/demo/noise.h"

namespace blockwalk {
namespace {

constexpr double kHeight = 808.0 / 2172;                                 // y
constexpr double kDepth = 460.0 / 2172;                                  // z, upwards
constexpr std::array<double, 4> kLayers = {0.050, 0.064, 0.078, 0.092};  // undersides of the copper layers
constexpr double kTop = 0.098;                                           // of the board
constexpr double kPitch = 1.0 / 120;                                     // of the routing grid
const glm::dvec3 kCopper(214, 128, 72);
const glm::dvec3 kGold(246, 202, 96);
const glm::dvec3 kSolder(196, 202, 212);

struct Box {
  glm::dvec3 low{0};
  glm::dvec3 high{0};
  bool contains(glm::dvec3 p) const {
    return glm::all(glm::greaterThanEqual(p, low)) && glm::all(glm::lessThan(p, high));
  }
};

struct Part {
  Box box;
  Matter matter;
};

class Chip final : public DemoModel {
 public:
  explicit Chip(int size) : dims_(demoDims(size, {2172, 808, 460})), voxel_(1.0 / size) {
    die_ = {{0.37, 0.085, kTop + 0.006}, {0.63, kHeight - 0.085, kTop + 0.026}};
    addCapacitors();
    addWires();
    wire_index_.emplace(wires_, kHeight, kDepth);
  }

  VoxelType type() const override { return VoxelType::rgba8; }
  glm::ivec3 dims() const override { return dims_; }

  void writeRow(int y, int z, std::span<std::byte> out) override {
    glm::dvec3 point(0, (y + 0.5) * voxel_, (z + 0.5) * voxel_);
    const bool in_board = point.z < kTop + 0.012;
    const bool in_die = point.z > die_.low.z - voxel_ && point.z < die_.high.z + 0.004 + voxel_;
    for (int x = 0; x < dims_.x && (in_board || in_die); ++x) {
      point.x = (x + 0.5) * voxel_;
      const auto matter = boardOrDie(point);
      if (matter) writeMatter(*matter, &out[static_cast<std::size_t>(x) * 4]);
    }
    for (const Part& part : parts_) drawPart(part, point, out);
    for (const std::uint32_t i : wire_index_->near(point.y, point.z)) drawWire(wires_[i], point, out);
  }

 private:
  double thin(double wanted) const { return std::max(wanted, 1.5 * voxel_); }

  void addCapacitors() {
    for (int i = 0; i < 14; ++i) {
      const double x = 0.07 + 0.125 * (i % 7) + (i % 7 > 2 ? 0.11 : 0);
      const double y = i < 7 ? 0.035 : kHeight - 0.053;
      const glm::dvec3 low(x, y, kTop);
      parts_.push_back({{low, low + glm::dvec3(0.006, 0.018, 0.014)}, {kSolder, 222}});
      parts_.push_back(
          {{low + glm::dvec3(0.006, 0.001, 0.001), low + glm::dvec3(0.026, 0.017, 0.013)}, {{172, 138, 98}, 134}});
      parts_.push_back({{low + glm::dvec3(0.026, 0, 0), low + glm::dvec3(0.032, 0.018, 0.014)}, {kSolder, 222}});
    }
  }

  // Bond wires rise from pads on the die's rim and fall in an arc to fingers on the board.
  void addWires() {
    constexpr int kWires = 34;
    for (int side = 0; side < 2; ++side) {
      for (int i = 0; i < kWires; ++i) {
        const double t = (i + 0.5) / kWires;
        const double sign = side == 0 ? -1 : 1;
        const glm::dvec3 pad(side == 0 ? die_.low.x + 0.008 : die_.high.x - 0.008, mixed(die_.low.y, die_.high.y, t),
                             die_.high.z + 0.002);
        const double reach = 0.10 + 0.045 * (i % 2);
        const glm::dvec3 finger(pad.x + sign * reach, mixed(0.03, kHeight - 0.03, t), kTop + 0.003);
        const double rise = 0.038 + 0.016 * (i % 2);
        glm::dvec3 before = pad;
        constexpr int kPieces = 14;
        for (int k = 1; k <= kPieces; ++k) {
          const double s = static_cast<double>(k) / kPieces;
          glm::dvec3 next = glm::mix(pad, finger, s);
          next.z += rise * 4 * s * (1 - s) * (1.35 - 0.7 * s);
          const double radius = thin(0.0013) / 1.5;
          wires_.push_back({before, next, radius, radius});
          before = next;
        }
        wires_.push_back({pad, pad, 0.0036, 0.0036});
        const glm::dvec3 half(0.010, 0.0026, thin(0.002) / 2);
        parts_.push_back({{finger - half, finger + half}, {kGold, 236}});
      }
    }
  }

  std::optional<Matter> boardOrDie(glm::dvec3 point) const {
    if (die_.contains(point)) return dieAt(point);
    if (point.x < 0.02 || point.x > 0.98 || point.y < 0.015 || point.y > kHeight - 0.015) return std::nullopt;
    if (auto matter = viaAt(point)) return matter;
    for (std::size_t layer = 0; layer < kLayers.size(); ++layer) {
      const double up = point.z - kLayers[layer];
      if (up >= 0 && up < thin(0.0035)) return traceAt(point, static_cast<std::int32_t>(layer));
    }
    return ballAt(point);
  }

  std::optional<Matter> dieAt(glm::dvec3 point) const {
    const double under = die_.high.z - point.z;
    if (under < thin(0.002)) {
      // The die's face: blocks of logic and memory in different textures.
      const glm::ivec2 block(glm::floor(glm::dvec2(point) * 42.0));
      const glm::ivec2 gate(glm::floor(glm::dvec2(point) * 400.0));
      const double kind = hashUnit(hashCell(block.x / 2, block.y, 1, 33));
      const double gates = hashUnit(hashCell(gate.x, kind < 0.5 ? 0 : gate.y, 2, 33));
      const glm::dvec3 tint = kind < 0.35  ? glm::dvec3(92, 132, 178)
                              : kind < 0.7 ? glm::dvec3(150, 112, 170)
                                           : glm::dvec3(92, 166, 148);
      return Matter{tint * (0.6 + 0.5 * gates), 150 + 24 * gates};
    }
    // The body of silicon is left hollow but for its skin, as an X-ray hardly sees it.
    const double skin = thin(0.003);
    const bool inside = point.x > die_.low.x + skin && point.x < die_.high.x - skin && point.y > die_.low.y + skin &&
                        point.y < die_.high.y - skin && point.z > die_.low.z + skin;
    if (inside) return std::nullopt;
    return Matter{{104, 112, 128}, 88};
  }

  // Vias join neighbouring layers at hashed points of the routing grid.
  std::optional<Matter> viaAt(glm::dvec3 point) const {
    if (point.z < kLayers.front() || point.z > kTop) return std::nullopt;
    const glm::ivec2 c(glm::floor(glm::dvec2(point) / kPitch));
    const std::uint32_t h = hashCell(c.x, c.y, 0, 35);
    if (hashUnit(h) > 0.07) return std::nullopt;
    const std::size_t from = hashBits(h) % 3;
    const bool through = hashUnit(hashBits(h + 5)) < 0.3;
    if (!through && (point.z < kLayers[from] || point.z > kLayers[from + 1])) return std::nullopt;
    const glm::dvec2 d = glm::dvec2(point) - (glm::dvec2(c) + 0.5) * kPitch;
    const double r = std::sqrt(glm::dot(d, d));
    const double outer = thin(0.0026);
    if (r > outer || (r < outer - thin(0.0012) && outer > 3 * voxel_)) return std::nullopt;
    return Matter{kCopper * 1.08, 216};
  }

  // On even layers traces run along x, on odd ones along y; a few change track. The lowest layer is a ground plane with
  // clearances.
  std::optional<Matter> traceAt(glm::dvec3 point, std::int32_t layer) const {
    const bool along_x = layer % 2 == 0;
    const double run = (along_x ? point.x : point.y) / kPitch;
    const double across = (along_x ? point.y : point.x) / kPitch;
    const double track = std::floor(across);
    const double segment = std::floor(run / 9 + hashUnit(hashCell(static_cast<std::int32_t>(track), layer, 7, 36)));
    const double used =
        hashUnit(hashCell(static_cast<std::int32_t>(track), static_cast<std::int32_t>(segment), layer, 37));
    if (used > 0.66) return std::nullopt;
    const double half = used < 0.08 ? 0.36 : 0.17;
    if (std::fabs(across - track - 0.5) * kPitch > std::max(half * kPitch, 0.75 * voxel_)) return std::nullopt;
    const double shade = 0.85 + 0.2 * hashUnit(hashCell(static_cast<std::int32_t>(track), layer, 3, 38));
    return Matter{kCopper * shade, 186 + 6.0 * layer};
  }

  std::optional<Matter> ballAt(glm::dvec3 point) const {
    constexpr double kBallPitch = 0.036;
    const glm::dvec2 c = glm::floor(glm::dvec2(point) / kBallPitch);
    const glm::dvec2 middle = (c + 0.5) * kBallPitch;
    if (middle.y > kHeight - 0.02) return std::nullopt;
    const glm::dvec3 d = (point - glm::dvec3(middle, 0.026)) / glm::dvec3(0.0145, 0.0145, 0.023);
    const double r2 = glm::dot(d, d);
    if (r2 > 1) return std::nullopt;
    // A few balls have a void, which is what such a scan is made to find.
    const std::uint32_t h = hashCell(static_cast<std::int32_t>(c.x), static_cast<std::int32_t>(c.y), 4, 39);
    const glm::dvec3 hole = d - glm::dvec3(0.3 * hashUnit(h) - 0.15, 0.3 * hashUnit(hashBits(h)) - 0.15, 0.1);
    if (hashUnit(hashBits(h + 9)) < 0.2 && glm::dot(hole, hole) < 0.16) return std::nullopt;
    return Matter{kSolder * (0.8 + 0.2 * (1 - r2)), 228};
  }

  void drawPart(const Part& part, glm::dvec3 point, std::span<std::byte> out) const {
    if (point.y < part.box.low.y || point.y >= part.box.high.y || point.z < part.box.low.z ||
        point.z >= part.box.high.z) {
      return;
    }
    const int first = std::max(0, static_cast<int>(part.box.low.x / voxel_));
    const int last = std::min(dims_.x - 1, static_cast<int>(part.box.high.x / voxel_));
    for (int x = first; x <= last; ++x) writeMatter(part.matter, &out[static_cast<std::size_t>(x) * 4]);
  }

  void drawWire(const Capsule& wire, glm::dvec3 point, std::span<std::byte> out) const {
    const double reach = std::max(wire.radius_a, wire.radius_b);
    const int first = std::max(0, static_cast<int>((std::min(wire.a.x, wire.b.x) - reach) / voxel_));
    const int last = std::min(dims_.x - 1, static_cast<int>((std::max(wire.a.x, wire.b.x) + reach) / voxel_));
    for (int x = first; x <= last; ++x) {
      point.x = (x + 0.5) * voxel_;
      const CapsuleHit hit = locateInCapsule(wire, point);
      if (hit.distance > 1) continue;
      writeMatter({kGold * (1.05 - 0.2 * hit.distance), 252}, &out[static_cast<std::size_t>(x) * 4]);
    }
  }

  glm::ivec3 dims_;
  double voxel_;
  Box die_;
  std::vector<Part> parts_;
  std::vector<Capsule> wires_;
  std::optional<CapsuleIndex> wire_index_;
};

}  // namespace

std::unique_ptr<DemoModel> makeChip(int size) { return std::make_unique<Chip>(size); }

}  // namespace blockwalk
