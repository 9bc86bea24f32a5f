// SPDX-License-Identifier: Apache-2.0
// Raw files with holes become the volumes of their dense copies, byte for byte.
#include <fcntl.h>
#include <unistd.h>

#include <cstdint>
#include <random>

#include "tests/volume/import/import_scratch.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"

namespace blockwalk {
namespace {

using volume_test::readBytes;

// Writes what of the bytes is not 0, page by page; false where the file system keeps no holes.
bool writeWithHoles(const std::filesystem::path& path, const std::string& bytes) {
  constexpr std::size_t kPage = 4096;
  std::filesystem::create_directories(path.parent_path());
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC, 0600);
  bool written = file >= 0 && ftruncate(file, static_cast<off_t>(bytes.size())) == 0;
  for (std::size_t at = 0; at < bytes.size() && written; at += kPage) {
    const std::string page = bytes.substr(at, kPage);
    if (page.find_first_not_of('\0') == std::string::npos) continue;
    written = pwrite(file, page.data(), page.size(), static_cast<off_t>(at)) == static_cast<ssize_t>(page.size());
  }
  const bool has_holes = written && lseek(file, 0, SEEK_HOLE) < static_cast<off_t>(bytes.size());
  close(file);
  return has_holes;
}

// Clumps of values in a row of zeros; each value takes `width` bytes.
std::string clumps(std::size_t values, std::size_t width, unsigned seed, bool negative) {
  std::string bytes(values * width, '\0');
  std::mt19937 random(seed);
  for (int clump = 0; clump < 40; ++clump) {
    const std::size_t begin = random() % values;
    for (std::size_t i = begin; i < std::min(begin + 700, values); ++i) {
      if (width == 4) {
        const float value = 0.25f * static_cast<float>(random() % 4000) - (negative ? 300.0f : 0.0f);
        std::memcpy(&bytes[i * width], &value, width);
      } else {
        for (std::size_t byte = 0; byte < width; ++byte) bytes[i * width + byte] = static_cast<char>(random());
        if (!negative) bytes[i * width + width - 1] &= 0x7f;
      }
    }
  }
  return bytes;
}

struct Holes : testing::Test {
  // Builds from the file with holes and from its dense copy, which has the same name in another folder.
  void expectTheSame(const std::string& bytes, const ImportOptions& options, const BuildOptions& build) {
    if (!writeWithHoles(scratch.path("holes/a.raw"), bytes)) GTEST_SKIP() << "no holes on this file system";
    scratch.write("dense/a.raw", bytes);
    const auto holes = openSource({scratch.path("holes/a.raw")}, options);
    const auto dense = openSource({scratch.path("dense/a.raw")}, options);
    EXPECT_FALSE(holes->info().blank.empty());
    EXPECT_TRUE(dense->info().blank.empty());
    buildVolume(*holes, scratch.path("holes.bwv"), build);
    buildVolume(*dense, scratch.path("dense.bwv"), build);
    EXPECT_EQ(readBytes(scratch.path("holes.bwv")), readBytes(scratch.path("dense.bwv")));
    EXPECT_GT(verifyVolume(*holes, scratch.path("dense.bwv")), 0u);
    EXPECT_EQ(readAll(*holes), readAll(*dense));
  }

  const Scratch scratch;
};

ImportOptions rawOf(glm::ivec3 dims, const char* type) {
  ImportOptions options;
  options.dims = dims;
  options.type = type;
  return options;
}

TEST_F(Holes, OfEveryTypeGiveTheVolumeOfZeros) {
  const glm::ivec3 dims(5000, 19, 23);
  const auto voxels = static_cast<std::size_t>(dims.x * dims.y * dims.z);
  const std::pair<const char*, std::size_t> types[] = {{"u8", 1},  {"i8", 1},  {"u16", 2},  {"i16", 2},
                                                       {"f32", 4}, {"u32", 4}, {"rgb8", 3}, {"rgba8", 4}};
  for (const auto& [type, width] : types) {
    for (const bool negative : {false, true}) {
      SCOPED_TRACE(std::string(type) + (negative ? ", negative ones too" : ""));
      const std::string bytes = clumps(voxels, width, 3, negative);
      expectTheSame(bytes, rawOf(dims, type), {.values = ValuesRule::guess});
    }
  }
}

TEST_F(Holes, AreNotEmptyBelowTheThreshold) {
  const glm::ivec3 dims(5000, 9, 11);
  const std::string bytes = clumps(static_cast<std::size_t>(dims.x * dims.y * dims.z), 1, 5, true);
  for (const double threshold : {-1.0, 0.0, 60.0}) {
    expectTheSame(bytes, rawOf(dims, "i8"), {.empty_thresholds = {threshold}});
    expectTheSame(bytes, rawOf(dims, "u8"), {.empty_thresholds = {threshold}});
  }
}

TEST_F(Holes, AreFoundInChannelsAndBehindAHeader) {
  const glm::ivec3 dims(3000, 9, 11);
  const auto voxels = static_cast<std::size_t>(dims.x * dims.y * dims.z);
  ImportOptions options = rawOf(dims, "u16");
  options.raw_channels = 2;
  options.big_endian = true;
  options.skip_bytes = 777;
  const std::string bytes = std::string(777, '#') + clumps(2 * voxels, 2, 7, true);
  expectTheSame(bytes, options, {});
  options.planar = true;
  expectTheSame(bytes, options, {.subblock_side = 4});
}

TEST_F(Holes, MayBeTheWholeFile) {
  const glm::ivec3 dims(4096, 30, 20);
  expectTheSame(std::string(static_cast<std::size_t>(4096 * 30 * 20), '\0'), rawOf(dims, "u8"), {});
}

TEST_F(Holes, OfSeparateChannelsMeet) {
  const glm::ivec3 dims(5000, 12, 10);
  const auto voxels = static_cast<std::size_t>(dims.x * dims.y * dims.z);
  ImportOptions options = rawOf(dims, "u8");
  options.channels = ChannelRule::separate;
  for (const unsigned seed : {1u, 2u}) {
    const std::string bytes = clumps(voxels, 1, seed, true);
    const std::string name = seed == 1 ? "a.raw" : "b.raw";
    if (!writeWithHoles(scratch.path("holes/" + name), bytes)) GTEST_SKIP() << "no holes on this file system";
    scratch.write("dense/" + name, bytes);
  }
  const auto open = [&](const char* a, const char* b) {
    return openSource({scratch.path(a), scratch.path(b)}, options);
  };
  const auto built = [&](Source& source) {
    buildVolume(source, scratch.path("a.bwv"), {});
    return readBytes(scratch.path("a.bwv"));
  };
  const auto dense = open("dense/a.raw", "dense/b.raw");
  const auto holes = open("holes/a.raw", "holes/b.raw");
  const auto mixed = open("holes/a.raw", "dense/b.raw");
  EXPECT_EQ(holes->info().blank.size(), 2u);
  EXPECT_TRUE(mixed->info().blank.empty());
  const std::string expected = built(*dense);
  EXPECT_EQ(built(*holes), expected);
  EXPECT_EQ(built(*mixed), expected);
}

}  // namespace
}  // namespace blockwalk
