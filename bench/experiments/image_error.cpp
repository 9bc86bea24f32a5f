// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments/image_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "volume/error.h"

namespace blockwalk::bench {
namespace {

constexpr int kWindow = 11;
constexpr int kReach = kWindow / 2;
constexpr double kSigma = 1.5;

double channelOf(std::uint32_t pixel, int channel) { return static_cast<double>(pixel >> (8 * channel) & 255u); }

double luma(double r, double g, double b) { return 0.2126 * r + 0.7152 * g + 0.0722 * b; }

struct Plane {
  int width = 0;
  int height = 0;
  std::vector<double> values;
  double at(int x, int y) const {
    const auto cx = static_cast<std::size_t>(std::clamp(x, 0, width - 1));
    const auto cy = static_cast<std::size_t>(std::clamp(y, 0, height - 1));
    return values[cy * static_cast<std::size_t>(width) + cx];
  }
};

std::array<double, kWindow> gaussian() {
  std::array<double, kWindow> weights{};
  double sum = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double x = static_cast<double>(i) - kReach;
    weights[i] = std::exp(-x * x / (2 * kSigma * kSigma));
    sum += weights[i];
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

// Wang, Bovik, Sheikh, Simoncelli 2004, equation 13, mean over all pixels.
double structuralSimilarity(const Plane& a, const Plane& b) {
  constexpr double kC1 = (0.01 * 255) * (0.01 * 255);
  constexpr double kC2 = (0.03 * 255) * (0.03 * 255);
  const auto weights = gaussian();
  double sum = 0;
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      double mean_a = 0, mean_b = 0, aa = 0, bb = 0, ab = 0;
      for (int j = 0; j < kWindow; ++j) {
        for (int i = 0; i < kWindow; ++i) {
          const double w = weights[static_cast<std::size_t>(i)] * weights[static_cast<std::size_t>(j)];
          const double va = a.at(x + i - kReach, y + j - kReach);
          const double vb = b.at(x + i - kReach, y + j - kReach);
          mean_a += w * va;
          mean_b += w * vb;
          aa += w * va * va;
          bb += w * vb * vb;
          ab += w * va * vb;
        }
      }
      const double var_a = aa - mean_a * mean_a, var_b = bb - mean_b * mean_b, covariance = ab - mean_a * mean_b;
      sum += (2 * mean_a * mean_b + kC1) * (2 * covariance + kC2) /
             ((mean_a * mean_a + mean_b * mean_b + kC1) * (var_a + var_b + kC2));
    }
  }
  return sum / (static_cast<double>(a.width) * a.height);
}

}  // namespace

ImageError imageError(std::span<const std::uint32_t> pixels, const reference::Image& truth) {
  BLOCKWALK_CHECK(pixels.size(), ==, truth.pixels.size());
  ImageError error;
  Plane ours{.width = truth.width, .height = truth.height, .values = {}};
  Plane theirs = ours;
  double squared = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    std::array<double, 3> a{}, b{};
    for (int c = 0; c < 3; ++c) {
      const auto channel = static_cast<std::size_t>(c);
      a[channel] = channelOf(pixels[i], c);
      b[channel] = 255 * truth.pixels[i].color[c];
      const double difference = std::abs(a[channel] - b[channel]);
      squared += difference * difference;
      error.largest = std::max(error.largest, difference);
    }
    ours.values.push_back(luma(a[0], a[1], a[2]));
    theirs.values.push_back(luma(b[0], b[1], b[2]));
  }
  error.rmse = std::sqrt(squared / (3 * static_cast<double>(pixels.size())));
  error.psnr = 20 * std::log10(255 / std::max(error.rmse, 1e-12));
  error.ssim = structuralSimilarity(ours, theirs);
  return error;
}

}  // namespace blockwalk::bench
