// SPDX-License-Identifier: Apache-2.0
#include "volume/import/value_offset.h"

#include <cmath>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {
namespace {

constexpr glm::ivec3 kDims{5, 4, 3};
constexpr std::size_t kVoxels = 60;

ImportOptions rawOf(const char* type) {
  ImportOptions options;
  options.dims = kDims;
  options.type = type;
  return options;
}

template <typename T>
std::vector<T> valuesFrom(T first, T step) {
  std::vector<T> values(kVoxels);
  for (std::size_t i = 0; i < kVoxels; ++i) values[i] = static_cast<T>(first + step * static_cast<T>(i));
  return values;
}

// The values that come back, less `first`, in steps; the offset must keep every one.
template <typename T>
void expectKept(const Scratch& scratch, const char* type, T first, T step) {
  const auto values = valuesFrom(first, step);
  const auto path = scratch.write("a.raw", bytesOf(values));
  ImportOptions options = rawOf(type);
  const auto offset = offsetThatKeeps(*openSource({path}, options));
  ASSERT_TRUE(offset.has_value()) << type;
  options.value_offset = offset;
  const auto source = openSource({path}, options);
  const std::string all = readAll(*source);
  EXPECT_EQ(source->conversion(0).largest_rounding, 0) << type;
  const SourceChannel& channel = source->info().channels[0];
  for (std::size_t i = 1; i < kVoxels; ++i) {
    float pair[2];
    std::memcpy(pair, &all[(i - 1) * sizeof(float)], sizeof pair);
    ASSERT_EQ(channel.value_scale * static_cast<double>(pair[1] - pair[0]), static_cast<double>(step)) << type << i;
  }
  float stored = 0;
  std::memcpy(&stored, all.data(), sizeof stored);
  EXPECT_NEAR(channel.value_offset + channel.value_scale * static_cast<double>(stored), static_cast<double>(first),
              std::fabs(static_cast<double>(first)) * 1e-15)
      << type;
}

TEST(ValueOffset, KeepsDifferencesOfValuesFarFromZero) {
  const Scratch scratch;
  expectKept<std::uint32_t>(scratch, "u32", 4'000'000'001u, 3);
  expectKept<std::int32_t>(scratch, "i32", -2'000'000'001, 7);
  expectKept<double>(scratch, "f64", 1.7e12, 0.0078125);
}

// NRRD has 64-bit integers.
TEST(ValueOffset, KeepsDifferencesOfLongIntegers) {
  const Scratch scratch;
  const auto values = valuesFrom<std::int64_t>((std::int64_t{1} << 60) + 1, 5);
  const auto path =
      scratch.write("a.nrrd", "NRRD0004\ntype: int64\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: raw\n\n" +
                                  bytesOf(values));
  ImportOptions options;
  options.value_offset = offsetThatKeeps(*openSource({path}, options));
  ASSERT_TRUE(options.value_offset.has_value());
  const auto source = openSource({path}, options);
  const std::string all = readAll(*source);
  EXPECT_EQ(source->conversion(0).largest_rounding, 0);
  for (std::size_t i = 0; i < kVoxels; ++i) {
    float stored = 0;
    std::memcpy(&stored, &all[i * sizeof stored], sizeof stored);
    EXPECT_EQ(static_cast<std::int64_t>(*options.value_offset) + static_cast<std::int64_t>(stored), values[i]);
  }
}

TEST(ValueOffset, IsNoneWhereThereIsNothingToGain) {
  const Scratch scratch;
  const auto none = [&](const char* type, const std::string& bytes) {
    return !offsetThatKeeps(*openSource({scratch.write("a.raw", bytes)}, rawOf(type))).has_value();
  };
  EXPECT_TRUE(none("u32", bytesOf(valuesFrom<std::uint32_t>(0, 100'000'001 / 60)))) << "from 0 on";
  EXPECT_TRUE(none("u32", bytesOf(valuesFrom<std::uint32_t>(1000, 1)))) << "nothing is rounded";
  EXPECT_TRUE(none("f64", bytesOf(valuesFrom<double>(0.1, 0.1)))) << "not far from 0";
  EXPECT_TRUE(none("f64", bytesOf(std::vector<double>(kVoxels, std::nan(""))))) << "no value at all";
  EXPECT_TRUE(none("u16", bytesOf(valuesFrom<std::uint16_t>(60000, 1)))) << "kept as it is";
  EXPECT_TRUE(none("f32", bytesOf(valuesFrom<float>(1e9f, 64)))) << "kept as it is";
  EXPECT_FALSE(none("f64", bytesOf(std::vector<double>(kVoxels, 1e9 + 0.25)))) << "one value, which is rounded";
}

}  // namespace
}  // namespace blockwalk
