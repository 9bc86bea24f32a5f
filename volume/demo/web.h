// SPDX-License-Identifier: Apache-2.0
// The cosmic web in outline: which nodes there are, what runs between them, and what lies around.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "volume/demo/capsules.h"

namespace blockwalk {

// A piece of a strand, which is a row of pieces that meet; or a ball, whose ends are one point.
struct WebPiece {
  Capsule capsule;
  double peak_a = 0;  // density at the middle line, 0..1
  double peak_b = 0;
  bool is_ball = false;

  // 0 from the capsule's surface on.
  double densityAt(glm::dvec3 point) const;
};

// All of it, in model space. As many pieces whatever the size, which only decides how thick they are.
std::vector<WebPiece> growWeb(int size);

// Pieces by where they are: the unit cube in kBinsAcross^3 bins.
class WebIndex {
 public:
  // The pieces outlive it.
  explicit WebIndex(std::span<const WebPiece> pieces);

  // Whether a piece may reach into the box from `low` to `high`; never false where one does.
  bool mayReach(glm::dvec3 low, glm::dvec3 high) const;
  // Those that may, ascending.
  void findIn(glm::dvec3 low, glm::dvec3 high, std::vector<std::uint32_t>& found) const;

 private:
  template <typename Visit>
  bool anyBin(glm::dvec3 low, glm::dvec3 high, Visit visit) const;
  bool reaches(const WebPiece& piece, glm::dvec3 low, glm::dvec3 high) const;

  std::span<const WebPiece> pieces_;
  std::vector<std::uint32_t> firsts_;  // of each bin in ids_, and the end
  std::vector<std::uint32_t> ids_;
};

}  // namespace blockwalk
