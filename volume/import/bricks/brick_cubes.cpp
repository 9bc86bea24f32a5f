// SPDX-License-Identifier: Apache-2.0
#include "volume/import/bricks/brick_cubes.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <utility>

#include "volume/error.h"
#include "volume/formats/hz_order.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

constexpr std::size_t kOpenFiles = 64;
constexpr int kGreatestCube = 64;
constexpr int kLeastCube = 8;  // what a build's strips ask for at once

// A layer of cubes holds what comes along x and y before the next is needed: where it fits in half of the memory,
// nothing is read twice.
int cubeSide(const PrismMetadata& metadata, std::uint64_t memory_bytes) {
  const auto plane = static_cast<std::uint64_t>(metadata.dims.x) * static_cast<std::uint64_t>(metadata.dims.y) *
                     static_cast<std::uint64_t>(metadata.bytes_per_voxel);
  int side = kGreatestCube;
  while (side > kLeastCube && plane * static_cast<std::uint64_t>(side) > memory_bytes / 2) side /= 2;
  return side;
}

// Where voxels of a cube of side 2^bits lie in rows, by Morton code: a table for three bits of each axis, of which
// kGreatestCube takes two.
class RasterOrder {
 public:
  explicit RasterOrder(int bits) {
    for (std::uint64_t code = 0; code < low_.size(); ++code) {
      const glm::ivec3 position = mortonPosition(code);
      low_[code] = static_cast<std::uint32_t>(position.x | position.y << bits | position.z << 2 * bits);
    }
  }
  std::size_t operator[](std::uint64_t code) const { return low_[code & 511] + (low_[code >> 9] << 3); }

 private:
  std::array<std::uint32_t, 512> low_{};
};

const RasterOrder& rasterOrder(int bits) {
  static const auto kOrders = [] {
    std::vector<RasterOrder> orders;
    for (int i = 0; 1 << i <= kGreatestCube; ++i) orders.emplace_back(i);
    return orders;
  }();
  return kOrders[static_cast<std::size_t>(bits)];
}

// The samples belong to the voxels with the codes `step`, 3 step, 5 step and so on.
template <typename T>
void scatter(std::span<const std::byte> samples, std::uint64_t step, const RasterOrder& order,
             std::span<std::byte> cube) {
  std::uint64_t code = step;
  for (std::size_t at = 0; at < samples.size(); at += sizeof(T), code += 2 * step) {
    std::memcpy(&cube[order[code] * sizeof(T)], &samples[at], sizeof(T));
  }
}

}  // namespace

std::shared_ptr<const InputFile> BrickFiles::open(const Brick& brick) {
  {
    const std::lock_guard lock(mutex_);
    const auto known = open_.find(brick.code);
    if (known != open_.end()) return known->second;
  }
  auto file = openDataFile(*header_, "bricks: filename", brick.file);
  const std::uint64_t bytes = brick.voxels() * static_cast<std::uint64_t>(metadata_.bytes_per_voxel);
  if (file->bytes() != bytes) {
    failData("{}: bricks: '{}' has {} bytes, a brick of size {} takes {}", header_->name(), brick.file, file->bytes(),
             brick.side, bytes);
  }
  const std::lock_guard lock(mutex_);
  if (open_.size() == kOpenFiles) open_.clear();
  open_[brick.code] = file;
  return file;
}

BrickCubes::BrickCubes(const PrismMetadata& metadata, BrickFiles& files, std::uint64_t memory_bytes)
    : metadata_(metadata), files_(files), side_(cubeSide(metadata, memory_bytes)), kept_(memory_bytes) {}

int BrickCubes::sideOf(const Brick& brick) const { return std::min(side_, brick.side); }

BrickCubes::Cube BrickCubes::get(const Brick& brick, glm::ivec3 voxel) {
  const glm::ivec3 first = voxel / sideOf(brick) * sideOf(brick);
  return kept_.get(mortonCode(glm::uvec3(first)), [&] { return read(brick, first - brick.position); });
}

// Voxels of an aligned cube whose codes have the same number of zeros at their end are a run of the file.
BrickCubes::Cube BrickCubes::read(const Brick& brick, glm::ivec3 first) const {
  const auto width = static_cast<std::size_t>(metadata_.bytes_per_voxel);
  const int brick_bits = sideBits(brick.side);
  const int bits = sideBits(sideOf(brick));
  const RasterOrder& order = rasterOrder(bits);
  const std::uint64_t voxels = std::uint64_t{1} << 3 * bits;
  const std::uint64_t code = mortonCode(glm::uvec3(first));
  const auto file = files_.open(brick);
  auto cube = std::make_shared<std::vector<std::byte>>(voxels * width);
  std::vector<std::byte> run(voxels / 2 * width);
  // The cube's first voxel has more zeros than any other, and lies by itself.
  file->read(hzFromMorton(code, brick_bits) * width, std::span(*cube).first(width));
  for (std::uint64_t step = 1; step < voxels; step *= 2) {
    const auto samples = std::span(run).first(voxels / (2 * step) * width);
    file->read(hzFromMorton(code + step, brick_bits) * width, samples);
    if (width == 1) {
      scatter<std::uint8_t>(samples, step, order, *cube);
    } else {
      scatter<std::uint16_t>(samples, step, order, *cube);
    }
  }
  return cube;
}

}  // namespace blockwalk
