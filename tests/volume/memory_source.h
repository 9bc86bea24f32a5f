// SPDX-License-Identifier: Apache-2.0
// A source in memory, random sparse volumes for it, and a folder that goes away with the test.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "volume/source.h"

namespace blockwalk::volume_test {

class MemorySource : public Source {
 public:
  MemorySource(VoxelType type, glm::ivec3 dims, std::size_t channels = 1) {
    info_.name = "memory";
    info_.format = "memory";
    info_.type = type;
    info_.dims = dims;
    info_.channels.resize(channels);
    info_.random_access = true;
    voxels.resize(voxelCount() * voxelBytes(type) * channels);
  }

  const SourceInfo& info() const override { return info_; }
  SourceInfo& change() { return info_; }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const std::size_t row_bytes = channelRowBytes(info_);
    const auto row = static_cast<std::size_t>(z) * static_cast<std::size_t>(info_.dims.y) + static_cast<std::size_t>(y);
    const auto bytes = static_cast<std::size_t>(count) * row_bytes;
    if (out.size() != bytes * info_.channels.size() || z >= info_.dims.z || y + count > info_.dims.y) {
      throw std::logic_error("rows outside the source");
    }
    if (!info_.random_access && row != next_row_ % voxelRows()) throw std::logic_error("rows out of order");
    next_row_ = row + static_cast<std::size_t>(count);
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      std::memcpy(out.data() + channel * bytes, voxels.data() + (channel * voxelRows() + row) * row_bytes, bytes);
    }
  }

  std::size_t voxelCount() const { return voxelRows() * static_cast<std::size_t>(info_.dims.x); }
  std::byte* at(glm::ivec3 p, std::size_t channel = 0) {
    const auto row = channel * voxelRows() + static_cast<std::size_t>(p.z) * static_cast<std::size_t>(info_.dims.y) +
                     static_cast<std::size_t>(p.y);
    return voxels.data() +
           (row * static_cast<std::size_t>(info_.dims.x) + static_cast<std::size_t>(p.x)) * voxelBytes(info_.type);
  }
  template <typename T>
  void set(glm::ivec3 p, T value, std::size_t channel = 0) {
    if (sizeof value != voxelBytes(info_.type)) throw std::logic_error("a value of another type");
    std::memcpy(at(p, channel), &value, sizeof value);
  }

  std::vector<std::byte> voxels;  // [channel][z][y][x]

 private:
  std::size_t voxelRows() const {
    return static_cast<std::size_t>(info_.dims.y) * static_cast<std::size_t>(info_.dims.z);
  }

  SourceInfo info_;
  std::size_t next_row_ = 0;
};

// Boxes of random voxels and of one value in an empty volume, some voxels alone, and for f32 NaN, infinities, negatives
// where `negative` asks for them, and -0; each channel has boxes of its own.
inline MemorySource randomSource(VoxelType type, glm::ivec3 dims, unsigned seed, bool negative = false,
                                 std::size_t channels = 1) {
  MemorySource source(type, dims, channels);
  std::mt19937 random(seed);
  const auto below = [&random](int bound) { return static_cast<int>(random() % static_cast<unsigned>(bound)); };
  const auto value = [&](int kind) -> std::uint32_t {
    if (type != VoxelType::f32) return random();
    if (kind == 0 && below(20) == 0) return 0x7fc00000;  // NaN
    if (kind == 0 && below(20) == 0) return 0xff800000;  // -infinity
    if (kind == 0 && below(20) == 0) return 0x80000000;  // -0
    const float density = static_cast<float>(below(2000) - (negative ? 700 : 0)) * 0.37f;
    std::uint32_t bits = 0;
    std::memcpy(&bits, &density, sizeof bits);
    return bits;
  };
  const int all = static_cast<int>(channels);
  for (int box = 0; box < 6 * all; ++box) {
    const glm::ivec3 begin(below(dims.x), below(dims.y), below(dims.z));
    const glm::ivec3 end = glm::min(begin + glm::ivec3(1 + below(23), 1 + below(23), 1 + below(23)), dims);
    const std::uint32_t same = value(1);
    for (int z = begin.z; z < end.z; ++z) {
      for (int y = begin.y; y < end.y; ++y) {
        for (int x = begin.x; x < end.x; ++x) {
          const std::uint32_t bits = box % 2 == 0 ? value(0) : same;
          std::memcpy(source.at({x, y, z}, static_cast<std::size_t>(box / 6)), &bits, voxelBytes(type));
        }
      }
    }
  }
  for (int i = 0; i < 5 * all; ++i) {
    const std::uint32_t bits = value(1);
    std::memcpy(source.at({below(dims.x), below(dims.y), below(dims.z)}, static_cast<std::size_t>(i / 5)), &bits,
                voxelBytes(type));
  }
  return source;
}

class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "blockwalk-test-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path = name;
  }
  ~ScratchFolder() { std::filesystem::remove_all(path); }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  std::filesystem::path operator/(const char* name) const { return path / name; }

  std::filesystem::path path;
};

inline std::string readBytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot open " + path.string());
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void writeBytes(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::remove(path);  // ext4 syncs a file that is truncated and written again
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace blockwalk::volume_test
