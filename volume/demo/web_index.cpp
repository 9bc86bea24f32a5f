// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "volume/demo/web.h"

namespace blockwalk {
namespace {

constexpr int kBinsAcross = 96;    // along each axis
constexpr int kBinsOfPieces = 64;  // of more it is only seen whether they hold anything

glm::ivec3 binOf(glm::dvec3 point) {
  return glm::clamp(glm::ivec3(glm::floor(glm::clamp(point, -1.0, 2.0) * static_cast<double>(kBinsAcross))),
                    glm::ivec3(0), glm::ivec3(kBinsAcross - 1));
}

std::size_t binIndex(int x, int y, int z) { return static_cast<std::size_t>((z * kBinsAcross + y) * kBinsAcross + x); }

}  // namespace

// Calls visit(bin) until it returns true.
template <typename Visit>
bool WebIndex::anyBin(glm::dvec3 low, glm::dvec3 high, Visit visit) const {
  const glm::ivec3 first = binOf(low);
  const glm::ivec3 last = binOf(high);
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        if (visit(binIndex(x, y, z))) return true;
      }
    }
  }
  return false;
}

WebIndex::WebIndex(std::span<const WebPiece> pieces) : pieces_(pieces), firsts_(binIndex(0, 0, kBinsAcross) + 1) {
  const auto forEachBin = [&](const WebPiece& piece, auto visit) {
    const Capsule& capsule = piece.capsule;
    const double reach = std::max(capsule.radius_a, capsule.radius_b);
    const glm::dvec3 low = glm::min(capsule.a, capsule.b) - reach;
    const glm::dvec3 high = glm::max(capsule.a, capsule.b) + reach;
    if (glm::any(glm::lessThan(high, glm::dvec3(0))) || glm::any(glm::greaterThan(low, glm::dvec3(1)))) return;
    anyBin(low, high, [&](std::size_t bin) {
      visit(bin);
      return false;
    });
  };
  for (const WebPiece& piece : pieces) forEachBin(piece, [&](std::size_t bin) { ++firsts_[bin + 1]; });
  for (std::size_t bin = 1; bin < firsts_.size(); ++bin) firsts_[bin] += firsts_[bin - 1];
  ids_.resize(firsts_.back());
  std::vector<std::uint32_t> next(firsts_.begin(), firsts_.end() - 1);
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    forEachBin(pieces[i], [&](std::size_t bin) { ids_[next[bin]++] = i; });
  }
}

// By the ball around the box.
bool WebIndex::reaches(const WebPiece& piece, glm::dvec3 low, glm::dvec3 high) const {
  const Capsule& capsule = piece.capsule;
  const glm::dvec3 center = (low + high) * 0.5;
  const glm::dvec3 axis = capsule.b - capsule.a;
  const double length2 = glm::dot(axis, axis);
  const double t = length2 > 0 ? glm::dot(center - capsule.a, axis) / length2 : 0;
  const glm::dvec3 off = center - capsule.a - axis * std::min(std::max(t, 0.0), 1.0);
  const double reach = std::max(capsule.radius_a, capsule.radius_b) + glm::length(high - low) * 0.5;
  return glm::dot(off, off) < reach * reach;
}

bool WebIndex::mayReach(glm::dvec3 low, glm::dvec3 high) const {
  const glm::ivec3 bins = binOf(high) - binOf(low) + 1;
  const bool large = bins.x * bins.y * bins.z > kBinsOfPieces;
  return anyBin(low, high, [&](std::size_t bin) {
    if (large) return firsts_[bin] < firsts_[bin + 1];
    return std::any_of(ids_.begin() + firsts_[bin], ids_.begin() + firsts_[bin + 1],
                       [&](std::uint32_t id) { return reaches(pieces_[id], low, high); });
  });
}

void WebIndex::findIn(glm::dvec3 low, glm::dvec3 high, std::vector<std::uint32_t>& found) const {
  found.clear();
  anyBin(low, high, [&](std::size_t bin) {
    for (std::uint32_t i = firsts_[bin]; i < firsts_[bin + 1]; ++i) {
      if (reaches(pieces_[ids_[i]], low, high)) found.push_back(ids_[i]);
    }
    return false;
  });
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
}

}  // namespace blockwalk
