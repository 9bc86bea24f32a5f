// SPDX-License-Identifier: Apache-2.0
#include "tests/renderer/compare.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

namespace blockwalk::test {
namespace {

std::array<std::uint8_t, 4> unpack(std::uint32_t pixel) {
  return {static_cast<std::uint8_t>(pixel), static_cast<std::uint8_t>(pixel >> 8),
          static_cast<std::uint8_t>(pixel >> 16), static_cast<std::uint8_t>(pixel >> 24)};
}

std::string colorText(const std::array<std::uint8_t, 4>& color) {
  return fmt::format("({},{},{},{})", color[0], color[1], color[2], color[3]);
}

void addPixel(ImageError& error, int x, int y, const std::array<std::uint8_t, 4>& a,
              const std::array<std::uint8_t, 4>& b) {
  const bool both_clear = a[3] == 0 && b[3] == 0;
  for (std::size_t c = 0; c < 4 && !both_clear; ++c) {
    const int difference = std::abs(int{a[c]} - int{b[c]});
    error.squared += difference * difference;
    if (difference <= error.largest) continue;
    error.largest = difference;
    error.worst = fmt::format("pixel ({},{}): {} against {}", x, y, colorText(a), colorText(b));
  }
  error.channels += 4;
}

void addWrong(ProbeError& error, bool excused, const std::string& what) {
  ++error.wrong;
  if (error.worst.empty() || (!excused && error.unexcused == 0)) error.worst = what;
  error.unexcused += excused ? 0 : 1;
}

template <typename Function>  // Function(index, x, y)
void forEachPixel(int width, int height, Function function) {
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      function(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x), x, y);
    }
  }
}

}  // namespace

double ImageError::psnr() const {
  if (squared == 0) return std::numeric_limits<double>::infinity();
  return 10 * std::log10(255.0 * 255.0 * static_cast<double>(channels) / squared);
}

void ImageError::add(const ImageError& other) {
  if (other.largest > largest) worst = other.worst;
  largest = std::max(largest, other.largest);
  squared += other.squared;
  channels += other.channels;
  drawn += other.drawn;
  skipped += other.skipped;
}

void ProbeError::add(const ProbeError& other) {
  if (worst.empty() || (unexcused == 0 && other.unexcused > 0)) worst = other.worst;
  pixels += other.pixels;
  met += other.met;
  wrong += other.wrong;
  unexcused += other.unexcused;
}

ImageError compareImages(const Frame& a, const Frame& b) {
  BLOCKWALK_CHECK(a.pixels.size(), ==, b.pixels.size());
  ImageError error;
  forEachPixel(a.width, a.height, [&](std::size_t at, int x, int y) {
    addPixel(error, x, y, unpack(a.pixels[at]), unpack(b.pixels[at]));
  });
  return error;
}

ImageError compareToReference(const Frame& frame, const reference::Image& expected,
                              const std::array<std::uint8_t, 4>& background, double near_jump) {
  BLOCKWALK_CHECK(frame.pixels.size(), ==, expected.pixels.size());
  ImageError error;
  forEachPixel(frame.width, frame.height, [&](std::size_t at, int x, int y) {
    const reference::Pixel& pixel = expected.pixels[at];
    const std::array<std::uint8_t, 4> color = reference::roundColor(pixel.color);
    error.drawn += color != background ? 1 : 0;
    const bool in_faces = near_jump == 0 && pixel.face_distance < kNearEdge;  // nothing jumps at a face of a field
    const bool has_rival = near_jump > 0 && 255 * pixel.rival_difference > 1;
    if (in_faces || has_rival || pixel.margin < near_jump) {
      ++error.skipped;
    } else {
      addPixel(error, x, y, unpack(frame.pixels[at]), color);
    }
  });
  return error;
}

ProbeError compareHits(const Frame& frame, const reference::Image& expected, double voxels_per_world) {
  BLOCKWALK_CHECK(frame.probes.size(), ==, expected.pixels.size());
  ProbeError error;
  error.pixels = expected.pixels.size();
  forEachPixel(frame.width, frame.height, [&](std::size_t at, int x, int y) {
    const reference::Pixel& pixel = expected.pixels[at];
    const Probe& probe = frame.probes[at];
    error.met += pixel.voxel.x >= 0 ? 1 : 0;
    const bool same_voxel = glm::ivec3(probe.x, probe.y, probe.z) == pixel.voxel;
    const double t_error = same_voxel && pixel.voxel.x >= 0 ? std::abs(static_cast<double>(probe.t) - pixel.t) : 0;
    // A float holds t to 6e-8 of itself.
    const bool same_t = t_error * voxels_per_world <= kNearEdge + 2e-7 * pixel.t * voxels_per_world;
    if (same_voxel && same_t) return;
    addWrong(error, pixel.edge_distance < kNearEdge || pixel.face_distance < kNearEdge,
             fmt::format(
                 "pixel ({},{}): voxel ({},{},{}) at t {} against ({},{},{}) at t {:.9g}, {:.3g} voxels from an edge",
                 x, y, probe.x, probe.y, probe.z, probe.t, pixel.voxel.x, pixel.voxel.y, pixel.voxel.z, pixel.t,
                 pixel.edge_distance));
  });
  return error;
}

ProbeError compareBlocks(const Frame& frame, const reference::Image& expected) {
  BLOCKWALK_CHECK(frame.probes.size(), ==, expected.pixels.size());
  ProbeError error;
  error.pixels = expected.pixels.size();
  forEachPixel(frame.width, frame.height, [&](std::size_t at, int x, int y) {
    const reference::Pixel& pixel = expected.pixels[at];
    error.met += pixel.blocks > 0 ? 1 : 0;
    if (frame.probes[at].blocks == pixel.blocks) return;
    addWrong(error, pixel.edge_distance < kNearEdge || pixel.face_distance < kNearEdge,
             fmt::format("pixel ({},{}): {} blocks against {}, {:.3g} voxels from a block's edge", x, y,
                         frame.probes[at].blocks, pixel.blocks, pixel.edge_distance));
  });
  return error;
}

}  // namespace blockwalk::test
