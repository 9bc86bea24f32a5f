// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/quadrature.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace blockwalk::reference {
namespace {

constexpr std::size_t kCount = kGaussNodes;

// Legendre polynomials 0..kCount at x in [-1, 1].
std::array<double, kCount + 1> legendre(double x) {
  std::array<double, kCount + 1> p{1, x};
  for (std::size_t k = 2; k <= kCount; ++k) {
    const auto n = static_cast<double>(k);
    p[k] = ((2 * n - 1) * x * p[k - 1] - (n - 1) * p[k - 2]) / n;
  }
  return p;
}

double legendreSlope(double x, const std::array<double, kCount + 1>& p) {
  return static_cast<double>(kCount) * (x * p[kCount] - p[kCount - 1]) / (x * x - 1);
}

}  // namespace

const std::array<QuadratureNode, kGaussNodes>& gaussRule() {
  static const auto rule = [] {
    std::array<QuadratureNode, kCount> nodes{};
    for (std::size_t i = 0; i < kCount; ++i) {
      double x = -std::cos(std::numbers::pi * (static_cast<double>(i) + 0.75) / (kCount + 0.5));
      for (int step = 0; step < 20; ++step) {
        const auto p = legendre(x);
        x -= p[kCount] / legendreSlope(x, p);
      }
      const double slope = legendreSlope(x, legendre(x));
      nodes[i] = {.x = (1 + x) / 2, .weight = 1 / ((1 - x * x) * slope * slope)};
    }
    return nodes;
  }();
  return rule;
}

const std::array<std::array<double, kGaussNodes>, kGaussNodes>& gaussPrimitive() {
  // Expand in Legendre polynomials by the rule itself, integrate each: (P[k+1] - P[k-1]) / (2k + 1).
  static const auto matrix = [] {
    std::array<std::array<double, kCount>, kCount> rows{};
    for (std::size_t i = 0; i < kCount; ++i) {
      const double x = 2 * gaussRule()[i].x - 1;
      const auto at_end = legendre(x);
      for (std::size_t j = 0; j < kCount; ++j) {
        const auto at_node = legendre(2 * gaussRule()[j].x - 1);
        double sum = x + 1;
        for (std::size_t k = 1; k < kCount; ++k) sum += at_node[k] * (at_end[k + 1] - at_end[k - 1]);
        rows[i][j] = gaussRule()[j].weight * sum / 2;
      }
    }
    return rows;
  }();
  return matrix;
}

}  // namespace blockwalk::reference
