// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <cmath>
#include <limits>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

ImportOptions rawOptions(glm::ivec3 dims, const std::string& type) {
  ImportOptions options;
  options.dims = dims;
  options.type = type;
  return options;
}

TEST(ImportRaw, KeepsUnsignedSamplesBitForBit) {
  const Scratch scratch;
  const std::vector<std::uint16_t> values = {0, 1, 255, 256, 65535, 4660, 7, 9, 11, 13, 15, 17};
  auto options = rawOptions({3, 2, 2}, "u16");
  EXPECT_EQ(importAll(scratch.write("a", bytesOf(values)), options), bytesOf(values));
  options.big_endian = true;
  EXPECT_EQ(importAll(scratch.write("b", swapped(bytesOf(values), 2)), options), bytesOf(values));
}

TEST(ImportRaw, MovesSignedSamplesByAnOffset) {
  const Scratch scratch;
  const auto file = scratch.write("a", bytesOf<std::int16_t>({-32768, -1, 0, 32767}));
  const auto source = openSource({file}, rawOptions({4, 1, 1}, "i16"));
  EXPECT_EQ(source->info().type, VoxelType::u16);
  EXPECT_EQ(source->info().channels[0].value_offset, -32768);
  EXPECT_EQ(readAll(*source), bytesOf<std::uint16_t>({0, 32767, 32768, 65535}));
  const auto bytes = scratch.write("b", bytesOf<std::int8_t>({-128, 0, 127}));
  const auto small = openSource({bytes}, rawOptions({3, 1, 1}, "i8"));
  EXPECT_EQ(small->info().channels[0].value_offset, -128);
  EXPECT_EQ(readAll(*small), bytesOf<std::uint8_t>({0, 128, 255}));
}

TEST(ImportRaw, ReportsRoundingAndWhatIsNotFinite) {
  const Scratch scratch;
  const auto counts = openSource({scratch.write("a", bytesOf<std::uint32_t>({5, 16777217, 4294967295u}))},
                                 rawOptions({3, 1, 1}, "u32"));
  EXPECT_EQ(readAll(*counts), bytesOf<float>({5, 16777216, 4294967296.0f}));
  EXPECT_EQ(counts->conversion(0).largest_rounding, 1);
  const double infinity = std::numeric_limits<double>::infinity();
  const auto reals =
      openSource({scratch.write("b", bytesOf<double>({0.1, std::nan(""), infinity, 2}))}, rawOptions({4, 1, 1}, "f64"));
  readAll(*reals);
  EXPECT_EQ(reals->conversion(0).nonfinite_voxels, 2u);
  EXPECT_EQ(reals->conversion(0).largest_rounding, std::fabs(0.1 - static_cast<double>(0.1f)));
  EXPECT_THAT(refusal({scratch.write("c", bytesOf<double>({1e300}))}, rawOptions({1, 1, 1}, "f64")),
              HasSubstr("1e+300"));
}

TEST(ImportRaw, MakesDensityOfColour) {
  const Scratch scratch;
  const auto file = scratch.write("a", bytesOf<std::uint8_t>({255, 0, 0, 10, 200, 30, 255, 255, 255}));
  auto options = rawOptions({3, 1, 1}, "rgb8");
  const std::string largest = bytesOf<std::uint8_t>({255, 0, 0, 255, 10, 200, 30, 200, 255, 255, 255, 255});
  EXPECT_EQ(importAll(file, options), largest) << "a dye is as dense as it is bright, whatever its colour";
  options.density = DensityRule::max;
  EXPECT_EQ(importAll(file, options), largest);
  options.density = DensityRule::luminance;
  EXPECT_EQ(importAll(file, options), bytesOf<std::uint8_t>({255, 0, 0, 54, 10, 200, 30, 147, 255, 255, 255, 255}));
  options.density = DensityRule::alpha;
  EXPECT_THAT(refusal({file}, options), HasSubstr("density"));
  options = rawOptions({9, 1, 1}, "u8");
  options.density = DensityRule::max;
  EXPECT_THAT(refusal({file}, options), HasSubstr("density"));
}

TEST(ImportRaw, SkipsBytesAndTakesSpacing) {
  const Scratch scratch;
  auto options = rawOptions({2, 2, 1}, "u8");
  options.skip_bytes = 3;
  options.spacing = glm::dvec3(1, 2, 0.5);
  const auto source = openSource({scratch.write("a", "###abcd")}, options);
  EXPECT_EQ(readAll(*source), "abcd");
  EXPECT_TRUE(source->info().random_access);
  const glm::dmat4 world = source->info().world_from_index;
  EXPECT_EQ(glm::dvec3(world * glm::dvec4(2, 2, 1, 1)), glm::dvec3(2, 4, 0.5));
}

TEST(ImportRaw, MustFitTheFileExactly) {
  const Scratch scratch;
  const auto file = scratch.write("a", std::string(23, 'x'));
  EXPECT_THAT(refusal({file}, rawOptions({4, 3, 2}, "u8")), AllOf(HasSubstr("23 bytes"), HasSubstr("24")));
  EXPECT_THAT(refusal({file}, rawOptions({11, 2, 1}, "u8")), AllOf(HasSubstr("23 bytes"), HasSubstr("22")));
  EXPECT_THAT(refusal({file}, rawOptions({65536, 65536, 65536}, "f64")), HasSubstr("2251799813685248"));
  EXPECT_THAT(refusal({file}, rawOptions({65537, 1, 1}, "u8")), HasSubstr("65536"));
  EXPECT_THAT(refusal({file}, rawOptions({23, 1, 0}, "u8")), HasSubstr("1..65536"));
  EXPECT_THAT(refusal({file}, rawOptions({23, 1, 1}, "u24")), HasSubstr("u24"));
  auto options = rawOptions({1, 1, 1}, "u8");
  options.skip_bytes = std::numeric_limits<std::uint64_t>::max();
  EXPECT_THAT(refusal({file}, options), HasSubstr("23 bytes"));
}

TEST(ImportRaw, UnpacksGzipToTheDeclaredLength) {
  const Scratch scratch;
  const std::string voxels = bytesOf<std::uint16_t>({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
  const auto file = scratch.write("a.raw.gz", gzipped(voxels));
  const auto source = openSource({file}, rawOptions({2, 3, 2}, "u16"));
  EXPECT_FALSE(source->info().random_access);
  EXPECT_EQ(readAll(*source, 1), voxels);
  EXPECT_EQ(readAll(*source, 2), voxels) << "a second pass starts again";
  const auto joined = scratch.write("b", gzipped(voxels.substr(0, 10)) + gzipped(voxels.substr(10)));
  EXPECT_EQ(importAll(joined, rawOptions({2, 3, 2}, "u16")), voxels);
  EXPECT_THAT(refusal({file}, rawOptions({2, 3, 3}, "u16")), AllOf(HasSubstr("24 bytes"), HasSubstr("36 were")));
  EXPECT_THAT(refusal({file}, rawOptions({2, 3, 1}, "u16")), AllOf(HasSubstr("24 bytes"), HasSubstr("12 were")));
}

TEST(ImportRaw, RefusesEveryCutOfAGzipStream) {
  const Scratch scratch;
  const std::string packed = gzipped(std::string(600, 'a') + std::string(400, 'b'));
  for (std::size_t length = 2; length < packed.size(); ++length) {
    const auto file = scratch.write("cut", packed.substr(0, length));
    EXPECT_FALSE(refusal({file}, rawOptions({10, 10, 10}, "u8")).empty()) << length;
  }
  std::string broken = packed;
  broken[packed.size() - 6] = static_cast<char>(broken[packed.size() - 6] ^ 0x20);  // its checksum
  EXPECT_THAT(refusal({scratch.write("sum", broken)}, rawOptions({10, 10, 10}, "u8")), HasSubstr("broken"));
}

TEST(ImportRaw, RefusesWhatIsNoRegularFile) {
  const Scratch scratch;
  ASSERT_EQ(mkfifo(scratch.path("pipe").c_str(), 0600), 0);
  EXPECT_THAT(refusal({scratch.path("pipe")}, rawOptions({1, 1, 1}, "u8")), HasSubstr("regular file"));
  EXPECT_THAT(refusal({"/dev/zero"}, rawOptions({1, 1, 1}, "u8")), HasSubstr("regular file"));
  EXPECT_THAT(refusal({scratch.path("absent")}), HasSubstr("No such file"));
  EXPECT_THAT(refusal({scratch.write("what", "is this")}), HasSubstr("--dims and --type"));
  EXPECT_THAT(refusal({scratch.write("empty", "")}), HasSubstr("--dims and --type"));
}

}  // namespace
}  // namespace blockwalk
