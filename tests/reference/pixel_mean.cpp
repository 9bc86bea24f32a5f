// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/pixel_mean.h"

#include <algorithm>
#include <cmath>

#include "tests/reference/converged.h"
#include "tests/reference/modes.h"

namespace blockwalk::reference {
namespace {

constexpr int kFewest = 16;
constexpr int kMost = 256;

// Point i of N: (i + 1/2) / N and i's bits behind the point in reverse, in the middle of its N-th.
glm::dvec2 hammersley(int i, int count) {
  double reversed = 0.5 / count;
  double place = 0.5;
  for (int bits = i; bits > 0; bits >>= 1, place /= 2) reversed += (bits & 1) != 0 ? place : 0;
  return {(i + 0.5) / count, reversed};
}

// Premultiplied.
struct Estimate {
  glm::dvec4 mean{0};
  double edge_error = 0;  // expected were all variation one edge, of the worst channel
};

double largest(const glm::dvec4& v) { return std::max({v.r, v.g, v.b, v.a}); }

Estimate estimate(const DenseVolume& volume, const View& view, int x, int y, int count) {
  glm::dvec4 sum(0), squares(0);
  for (int i = 0; i < count; ++i) {
    const glm::dvec4 color = renderPixelConverged(volume, view, x, y, hammersley(i, count)).color;
    const glm::dvec4 premultiplied(glm::dvec3(color) * color.a, color.a);
    sum += premultiplied;
    squares += premultiplied * premultiplied;
  }
  const glm::dvec4 mean = sum / static_cast<double>(count);
  const double deviation = std::sqrt(std::max(largest(squares / static_cast<double>(count) - mean * mean), 0.0));
  // An edge through the middle has twice the deviation for its contrast.
  return {.mean = mean, .edge_error = 0.3 * 2 * deviation * std::pow(count, -0.75)};
}

}  // namespace

Pixel renderPixelMean(const DenseVolume& volume, const View& resolved, int x, int y) {
  Estimate found = estimate(volume, resolved, x, y, kFewest);
  for (int count = 4 * kFewest; count <= kMost; count *= 4) {
    const Estimate finer = estimate(volume, resolved, x, y, count);
    const double change = largest(glm::abs(finer.mean - found.mean));
    found = finer;
    if (std::max(change, finer.edge_error) <= kMeanTolerance) break;
  }
  Pixel pixel;
  if (found.mean.a > 0) pixel.color = glm::dvec4(glm::dvec3(found.mean) / found.mean.a, found.mean.a);
  return pixel;
}

Image renderImageMean(const DenseVolume& volume, const View& resolved) {
  return renderEach(resolved, [&](int x, int y) { return renderPixelMean(volume, resolved, x, y); });
}

}  // namespace blockwalk::reference
