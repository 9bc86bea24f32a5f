// SPDX-License-Identifier: Apache-2.0
// Gauss-Legendre quadrature on [0, 1], and the integrals from 0 to each node that the same values give.
#pragma once

#include <array>

namespace blockwalk::reference {

constexpr int kGaussNodes = 16;

struct QuadratureNode {
  double x = 0;  // ascending
  double weight = 0;
};

// Exact for polynomials of degree 31.
const std::array<QuadratureNode, kGaussNodes>& gaussRule();

// Row i: the integral from 0 to node i is the sum of row[j] * f(node j), exact for polynomials of degree 15.
const std::array<std::array<double, kGaussNodes>, kGaussNodes>& gaussPrimitive();

}  // namespace blockwalk::reference
