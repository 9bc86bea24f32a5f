// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments/image_error.h"

#include <algorithm>
#include <cmath>

#include "volume/error.h"

namespace blockwalk::bench {
namespace {

constexpr int kWindow = 11;
constexpr int kReach = kWindow / 2;
constexpr double kSigma = 1.5;

double luma(const std::array<double, 3>& color) { return 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2]; }

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

Plane lumaOf(const ColorImage& image) {
  Plane plane{.width = image.width, .height = image.height, .values = {}};
  plane.values.reserve(image.pixels.size());
  for (const auto& color : image.pixels) plane.values.push_back(luma(color));
  return plane;
}

}  // namespace

ColorImage colorsOf(std::span<const std::uint32_t> pixels, int width, int height) {
  ColorImage image{.width = width, .height = height};
  image.pixels.reserve(pixels.size());
  for (const std::uint32_t pixel : pixels) {
    const auto channel = [&](int shift) { return static_cast<double>(pixel >> shift & 255u); };
    image.pixels.push_back({channel(0), channel(8), channel(16)});
  }
  return image;
}

ColorImage colorsOf(const reference::Image& image) {
  ColorImage colors{.width = image.width, .height = image.height};
  colors.pixels.reserve(image.pixels.size());
  for (const reference::Pixel& pixel : image.pixels) {
    colors.pixels.push_back({255 * pixel.color.r, 255 * pixel.color.g, 255 * pixel.color.b});
  }
  return colors;
}

ColorImage roundedColors(const ColorImage& image) {
  ColorImage rounded = image;
  for (auto& color : rounded.pixels) {
    for (double& channel : color) channel = std::round(channel);
  }
  return rounded;
}

ImageError imageError(const ColorImage& image, const ColorImage& truth) {
  BLOCKWALK_CHECK(image.pixels.size(), ==, truth.pixels.size());
  ImageError error;
  double squared = 0;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double difference = std::abs(image.pixels[i][c] - truth.pixels[i][c]);
      squared += difference * difference;
      error.largest = std::max(error.largest, difference);
    }
  }
  error.rmse = std::sqrt(squared / (3 * static_cast<double>(image.pixels.size())));
  error.psnr = 20 * std::log10(255 / std::max(error.rmse, 1e-12));
  error.ssim = structuralSimilarity(lumaOf(image), lumaOf(truth));
  return error;
}

}  // namespace blockwalk::bench
