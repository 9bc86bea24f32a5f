// SPDX-License-Identifier: Apache-2.0
#include "volume/demo/web.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "volume/demo/noise.h"

namespace blockwalk {
namespace {

constexpr std::uint32_t kSeed = 1957;
constexpr int kCells = 8;  // along each axis, with up to two nodes each
constexpr double kCell = 1.0 / kCells;
constexpr double kLongest = 1.9 * kCell;   // of strands
constexpr double kStrandRadius = 0.00105;  // of a strand of common strength
constexpr double kBallRadius = 0.004;      // of a cluster, about
constexpr int kThinnerFrom = 4096;         // voxels an axis
constexpr double kThickest = 0.012;        // that strands get to be as thick as a voxel

struct Node {
  glm::dvec3 place{0};
  double mass = 0;  // 0..1, mostly small
};

// How thick things are: with the size their share of the volume would stay, and all of it would be too much.
struct Thickness {
  double strand = 0;
  double ball = 0;
  double least = 0;

  explicit Thickness(int size) : strand(kStrandRadius), ball(kBallRadius), least(std::min(1.2 / size, kThickest)) {
    const double thinner = powTwo(-2.0 / 3 * logTwo(std::max(1.0, static_cast<double>(size) / kThinnerFrom)));
    strand = std::max(least, strand * thinner);
    ball = std::max(least, ball * thinner);
  }
};

class Web {
 public:
  explicit Web(int size) : thickness_(size) {
    placeNodes();
    for (std::size_t a = 0; a < nodes_.size(); ++a) {
      addCluster(a);
      for (std::size_t b = a + 1; b < nodes_.size(); ++b) connect(a, b);
    }
    scatterDust();
  }
  std::vector<WebPiece> take() { return std::move(pieces_); }

 private:
  // One layer of cells around the cube as well, so that strands end outside.
  void placeNodes() {
    for (int z = -1; z <= kCells; ++z) {
      for (int y = -1; y <= kCells; ++y) {
        for (int x = -1; x <= kCells; ++x) {
          HashSequence hash(hashCell(x, y, z, kSeed));
          const double many = hash.unit();
          for (int i = 0; i < (many < 0.2 ? 0 : many < 0.75 ? 1 : 2); ++i) {
            const glm::dvec3 in_cell{hash.unit(), hash.unit(), hash.unit()};
            const double mass = hash.unit();
            const Node node{.place = (glm::dvec3(x, y, z) + in_cell) * kCell, .mass = mass * mass * mass};
            // Voids are where there are none.
            if (voids_.at(node.place * 3.3 + 20.0) > 0.36) nodes_.push_back(node);
          }
        }
      }
    }
  }

  // Everything is carried along by one smooth field, which takes the straightness and the lattice out of it.
  glm::dvec3 carried(glm::dvec3 p) {
    const auto push = [&](double scale, double reach, std::size_t first) {
      const glm::dvec3 at = p * scale + 40.0;
      p += reach * (2.0 * glm::dvec3(drift_[first].at(at), drift_[first + 1].at(at), drift_[first + 2].at(at)) - 1.0);
    };
    push(3.1, 0.055, 0);
    push(11.0, 0.012, 3);
    push(47.0, 0.002, 6);
    return p;
  }

  // Strong strands between nodes that have no third nearer to both (relative neighbourhood graph, Toussaint 1980), and
  // some faint ones where only the ball between the two is free of others (Gabriel and Sokal 1969).
  void connect(std::size_t a, std::size_t b) {
    const glm::dvec3 from = nodes_[a].place;
    const glm::dvec3 to = nodes_[b].place;
    const double length = glm::length(to - from);
    if (length > kLongest || length < 0.15 * kCell) return;
    bool strong = true;
    const glm::dvec3 middle = (from + to) * 0.5;
    for (std::size_t other = 0; other < nodes_.size(); ++other) {
      if (other == a || other == b) continue;
      const glm::dvec3 place = nodes_[other].place;
      if (glm::length(place - middle) < 0.5 * length) return;
      strong = strong && std::max(glm::length(place - from), glm::length(place - to)) >= length;
    }
    HashSequence hash(hashCell(static_cast<std::int32_t>(a), static_cast<std::int32_t>(b), strong ? 1 : 0, kSeed + 7));
    if (!strong && hash.unit() > 0.3) return;
    addStrands(nodes_[a], nodes_[b], strong, hash);
  }

  void addStrands(const Node& a, const Node& b, bool strong, HashSequence& hash) {
    const glm::dvec3 axis = b.place - a.place;
    const double length = glm::length(axis);
    const glm::dvec3 any{hash.between(-1, 1), hash.between(-1, 1), hash.between(-1, 1)};
    const glm::dvec3 side = glm::normalize(glm::cross(axis, any + glm::dvec3(1e-3, 0, 0)));
    const glm::dvec3 other_side = glm::cross(axis / length, side);
    const double bend = hash.between(-0.16, 0.16) * length;
    const double strength = strong ? 0.75 + 0.6 * std::sqrt(std::max(a.mass, b.mass)) : hash.between(0.35, 0.6);
    const double radius = std::max(thickness_.least, thickness_.strand * strength);
    const int strands = strong ? 2 : 1;
    for (int strand = 0; strand < strands; ++strand) {
      const double phase = hash.unit();
      const double turns = hash.between(-1.2, 1.2);
      const double spread = (strands - 1) * hash.between(0.5, 1.0) * 0.028 * length;
      const auto placeAt = [&](double t) {
        const double angle = phase + turns * t + 0.5 * strand;
        const double off = spread * 4 * t * (1 - t);
        return carried(a.place + axis * t + side * (bend * 4 * t * (1 - t) + off * wave(angle)) +
                       other_side * (off * wave(angle + 0.25)));
      };
      addStrand(placeAt, radius, strong ? 1 : 0.6, length);
      addBeads(placeAt, radius, length, hash);
    }
  }

  // Thicker and denser towards both nodes.
  template <typename PlaceAt>
  void addStrand(PlaceAt placeAt, double radius, double density, double length) {
    const int pieces = std::clamp(static_cast<int>(length * 300), 12, 64);
    const auto nearEnd = [](double t) { return (2 * t - 1) * (2 * t - 1); };
    const auto radiusAt = [&](double t) { return radius * (0.9 + 0.6 * nearEnd(t)); };
    const auto peakAt = [&](double t) { return density * (0.5 + 0.3 * nearEnd(t)); };
    glm::dvec3 last = placeAt(0);
    for (int i = 1; i <= pieces; ++i) {
      const double before = static_cast<double>(i - 1) / pieces;
      const double t = static_cast<double>(i) / pieces;
      const glm::dvec3 next = placeAt(t);
      pieces_.push_back({.capsule = {last, next, radiusAt(before), radiusAt(t)},
                         .peak_a = peakAt(before),
                         .peak_b = peakAt(t),
                         .is_ball = false});
      last = next;
    }
  }

  // Groups of galaxies, most of them on the strand.
  template <typename PlaceAt>
  void addBeads(PlaceAt placeAt, double radius, double length, HashSequence& hash) {
    const int beads = 2 + static_cast<int>(length * hash.between(20, 60));
    for (int i = 0; i < beads; ++i) {
      const double t = hash.unit();
      const glm::dvec3 off{hash.between(-1, 1), hash.between(-1, 1), hash.between(-1, 1)};
      const double far = hash.unit();
      const double size = hash.unit();
      addBall(placeAt(t) + off * (radius * 5 * far * far), radius * (0.5 + 1.7 * size * size), 0.6 + 0.4 * size);
    }
  }

  void addBall(glm::dvec3 center, double radius, double peak) {
    radius = std::max(radius, thickness_.least);
    pieces_.push_back({.capsule = {center, center, radius, radius}, .peak_a = peak, .peak_b = peak, .is_ball = true});
  }

  // A ball with smaller ones around it.
  void addCluster(std::size_t index) {
    const Node& node = nodes_[index];
    HashSequence hash(hashBits(static_cast<std::uint32_t>(index) + kSeed));
    const glm::dvec3 center = carried(node.place);
    const double radius = thickness_.ball * (0.45 + 3 * node.mass);
    addBall(center, radius, 0.8 + 0.2 * node.mass);
    const int around = 3 + static_cast<int>(14 * node.mass);
    for (int i = 0; i < around; ++i) {
      const glm::dvec3 off{hash.between(-1, 1), hash.between(-1, 1), hash.between(-1, 1)};
      const double size = hash.unit();
      addBall(center + off * (2.2 * radius), radius * (0.12 + 0.3 * size * size), 0.4 + 0.5 * size);
    }
  }

  // Lone galaxies, in voids too.
  void scatterDust() {
    constexpr int kDustCells = 18;
    for (int z = 0; z < kDustCells; ++z) {
      for (int y = 0; y < kDustCells; ++y) {
        for (int x = 0; x < kDustCells; ++x) {
          HashSequence hash(hashCell(x, y, z, kSeed + 31));
          if (hash.unit() > 0.45) continue;
          const glm::dvec3 in_cell{hash.unit(), hash.unit(), hash.unit()};
          const double size = hash.unit();
          addBall(carried((glm::dvec3(x, y, z) + in_cell) / static_cast<double>(kDustCells)),
                  thickness_.strand * (0.4 + 0.5 * size), 0.12 + 0.2 * size);
        }
      }
    }
  }

  Thickness thickness_;
  Noise voids_{kSeed + 1};
  std::array<Noise, 9> drift_{Noise(2),  Noise(3),  Noise(5),  Noise(7), Noise(11),
                              Noise(13), Noise(17), Noise(19), Noise(23)};
  std::vector<Node> nodes_;
  std::vector<WebPiece> pieces_;
};

}  // namespace

double WebPiece::densityAt(glm::dvec3 point) const {
  const CapsuleHit hit = locateInCapsule(capsule, point);
  if (hit.distance >= 1) return 0;
  const double d2 = hit.distance * hit.distance;
  const double peak = mixed(peak_a, peak_b, hit.along);
  if (is_ball) {
    // A cluster: density (1 + r^2 / a^2)^(-5/2) (Plummer 1911), less what is left of it at the surface.
    constexpr double kCore2 = 1 / (0.4 * 0.4);
    const auto profile = [](double r2) {
      const double q = 1 / (1 + r2 * kCore2);
      return q * q * std::sqrt(q);
    };
    return peak * (profile(d2) - profile(1)) / (1 - profile(1));
  }
  // A filament: a core, and outside of it r^-2 (Colberg, Krughoff and Connolly 2005), less what is left at the surface.
  constexpr double kCore2 = 1 / (0.4 * 0.4);
  constexpr double kLeft = 1 / (1 + kCore2);
  return peak * (1 / (1 + d2 * kCore2) - kLeft) / (1 - kLeft);
}

std::vector<WebPiece> growWeb(int size) { return Web(size).take(); }

}  // namespace blockwalk
