// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <glm/glm.hpp>

#include "tests/volume/import/broken.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

// Words of the header by their number in the format's description, which counts from 1.
struct MrcWriter {
  std::string header = std::string(1024, '\0');
  bool is_big = false;

  template <typename T>
  void put(std::size_t word, T value) {
    std::string bytes = bytesOf<T>({value});
    if (is_big) bytes = swapped(bytes, sizeof(T));
    header.replace(4 * (word - 1), sizeof(T), bytes);
  }
  void put3(std::size_t word, glm::ivec3 values) {
    for (int i = 0; i < 3; ++i) put<std::int32_t>(word + static_cast<std::size_t>(i), values[i]);
  }
  void putf3(std::size_t word, glm::vec3 values) {
    for (int i = 0; i < 3; ++i) put<float>(word + static_cast<std::size_t>(i), values[i]);
  }
};

// 4 x 3 x 2 voxels of 0.5, 0.25 and 2 angstrom.
MrcWriter usual(std::int32_t mode, bool is_big = false) {
  MrcWriter writer{.is_big = is_big};
  writer.put3(1, {4, 3, 2});
  writer.put<std::int32_t>(4, mode);
  writer.put3(8, {4, 3, 2});
  writer.putf3(11, {2, 0.75, 4});
  writer.putf3(14, {90, 90, 90});
  writer.put3(17, {1, 2, 3});
  writer.header.replace(208, 4, "MAP ");
  writer.header.replace(212, 4, is_big ? std::string("\x11\x11\0\0", 4) : std::string("\x44\x44\0\0", 4));
  return writer;
}

template <typename T>
std::string counting(bool swap) {
  std::vector<T> values;
  for (int i = 0; i < 24; ++i) values.push_back(static_cast<T>(i * 7 - 20));
  return swap ? swapped(bytesOf(values), sizeof(T)) : bytesOf(values);
}

TEST(Mrc, ReadsEveryModeInBothByteOrders) {
  const Scratch scratch;
  for (const bool is_big : {false, true}) {
    const auto import = [&](std::int32_t mode, const std::string& voxels) {
      return openSource({scratch.write("a.mrc", usual(mode, is_big).header + voxels)}, {});
    };
    const auto bytes = import(0, counting<std::int8_t>(false));
    EXPECT_EQ(bytes->info().channels[0].value_offset, -128);
    std::string flipped = counting<std::int8_t>(false);
    for (char& byte : flipped) byte ^= '\x80';
    EXPECT_EQ(readAll(*bytes), flipped);
    EXPECT_EQ(import(1, counting<std::int16_t>(is_big))->info().channels[0].value_offset, -32768);
    EXPECT_EQ(readAll(*import(2, counting<float>(is_big))), counting<float>(false));
    EXPECT_EQ(readAll(*import(6, counting<std::uint16_t>(is_big))), counting<std::uint16_t>(false));
    const std::vector<std::uint16_t> halves(24, 0xc100);  // -2.5
    const std::string swapped_halves = swapped(bytesOf(halves), is_big ? 2 : 1);
    EXPECT_EQ(readAll(*import(12, swapped_halves)), bytesOf(std::vector<float>(24, -2.5f)));
  }
}

// Whose sizes begin as data sets of DICOM (8), AIM (20, 140) and NIfTI files (348) do.
TEST(Mrc, IsToldFromWhatBeginsAlike) {
  const Scratch scratch;
  for (const bool has_word : {true, false}) {
    for (const glm::ivec3& dims :
         {glm::ivec3(8, 4, 2), glm::ivec3(348, 2, 1), glm::ivec3(0x10008, 1, 1), glm::ivec3(20, 140, 1)}) {
      MrcWriter writer = usual(2);
      writer.put3(1, dims);
      if (!has_word) writer.header.replace(208, 4, std::string(4, '\0'));
      const auto bytes = static_cast<std::size_t>(dims.x * dims.y * dims.z) * sizeof(float);
      const std::string path = scratch.write("a.mrc", writer.header + std::string(bytes, '\0'));
      if (dims.x > 65536) {
        EXPECT_THAT(refusal({path}), HasSubstr("NX"));
      } else {
        EXPECT_EQ(openSource({path}, {})->info().dims, dims);
      }
    }
  }
}

TEST(Mrc, HasPlaceAndUnit) {
  const Scratch scratch;
  MrcWriter writer = usual(2);
  writer.put3(5, {10, 20, 30});
  const auto path = scratch.write("a.map", writer.header + counting<float>(false));
  const SourceInfo by_start = openSource({path}, {})->info();
  EXPECT_EQ(by_start.format, "mrc");
  EXPECT_EQ(by_start.length_unit, "angstrom");
  EXPECT_EQ(by_start.dims, glm::ivec3(4, 3, 2));
  EXPECT_EQ(worldOf(by_start, glm::dvec3(0.5)), glm::dvec3(5, 5, 60));
  EXPECT_EQ(worldOf(by_start, glm::dvec3(1.5)), glm::dvec3(5.5, 5.25, 62));
  EXPECT_THAT(by_start.notes, IsEmpty());
  writer.putf3(50, {-3, 4, 5});
  scratch.write("a.map", writer.header + counting<float>(false));
  EXPECT_EQ(worldOf(openSource({path}, {})->info(), glm::dvec3(0.5)), glm::dvec3(-3, 4, 5));
}

// Columns along z, rows along x, sections along y.
TEST(Mrc, AxesComeInAnyOrder) {
  const Scratch scratch;
  MrcWriter writer = usual(2);
  writer.put3(17, {3, 1, 2});
  writer.put3(5, {1, 2, 3});
  const auto source = openSource({scratch.write("a.mrc", writer.header + counting<float>(false))}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(4, 3, 2));
  EXPECT_EQ(worldOf(source->info(), glm::dvec3(0.5)), glm::dvec3(1, 0.75, 2));
  EXPECT_EQ(worldOf(source->info(), {1.5, 0.5, 0.5}), glm::dvec3(1, 0.75, 4));
  EXPECT_EQ(worldOf(source->info(), {0.5, 1.5, 0.5}), glm::dvec3(1.5, 0.75, 2));
  EXPECT_EQ(readAll(*source), counting<float>(false));
  writer.put3(17, {1, 2, 2});
  EXPECT_THAT(refusal({scratch.write("a.mrc", writer.header + counting<float>(false))}),
              HasSubstr("MAPC, MAPR, MAPS: 1, 2, 2 must be 1, 2 and 3 in some order"));
}

TEST(Mrc, CellsMayBeOblique) {
  const Scratch scratch;
  MrcWriter writer = usual(2);
  writer.putf3(14, {90, 90, 120});
  const SourceInfo info = openSource({scratch.write("a.mrc", writer.header + counting<float>(false))}, {})->info();
  const glm::dvec3 y(info.world_from_index[1]);
  EXPECT_NEAR(glm::length(y), 0.25, 1e-12);
  EXPECT_NEAR(y.x, -0.125, 1e-12);
  writer.putf3(14, {10, 90, 170});
  EXPECT_THAT(refusal({scratch.write("a.mrc", writer.header + counting<float>(false))}), HasSubstr("make no cell"));
}

TEST(Mrc, StacksAreTold) {
  const Scratch scratch;
  MrcWriter writer = usual(6);
  writer.put<std::int32_t>(3, 4);
  writer.put<std::int32_t>(23, 401);
  const std::string voxels = counting<std::uint16_t>(false) + std::string(48, 'b');
  const auto path = scratch.write("a.mrc", writer.header + voxels);
  EXPECT_THAT(openSource({path}, {})->info().notes,
              testing::Contains(HasSubstr("of 2 volumes, one after the other, it is the first")));
  EXPECT_EQ(importAll(path), counting<std::uint16_t>(false));
  ImportOptions second;
  second.frame = 1;
  EXPECT_EQ(importAll(path, second), std::string(48, 'b'));
  second.frame = 2;
  EXPECT_THAT(refusal({path}, second), HasSubstr("--frame 2 is outside 0..1"));
}

TEST(Mrc, ExtendedHeadersArePassedOverAndOldFilesKnown) {
  const Scratch scratch;
  MrcWriter writer = usual(6);
  writer.put<std::int32_t>(24, 160);
  writer.header.replace(208, 8, std::string(8, '\0'));
  EXPECT_EQ(importAll(scratch.write("a.mrc", writer.header + std::string(160, 'x') + counting<std::uint16_t>(false))),
            counting<std::uint16_t>(false));
  // Without its word a file of another length is none.
  EXPECT_THAT(refusal({scratch.write("a.mrc", writer.header + counting<std::uint16_t>(false))}),
              HasSubstr("is no file of a known format"));
}

TEST(Mrc, BrokenHeadersAreRefusedByNameAndBound) {
  const Scratch scratch;
  const auto with = [&](std::size_t word, std::int32_t value) {
    MrcWriter writer = usual(2);
    writer.put<std::int32_t>(word, value);
    return refusal({scratch.write("a.mrc", writer.header + counting<float>(false))});
  };
  EXPECT_THAT(with(4, 4), HasSubstr("a.mrc: mode: 4 cannot be read"));
  EXPECT_THAT(with(1, 70000), HasSubstr("NX, NY, NZ: 70000 is outside 1..65536"));
  EXPECT_THAT(with(2, 0), HasSubstr("NX, NY, NZ: 0 is outside"));
  EXPECT_THAT(with(3, 65536), HasSubstr("3145728 bytes of voxels from byte 1024 were declared, the file has 1120"));
  EXPECT_THAT(with(24, -1), HasSubstr("NSYMBT: -1"));
  EXPECT_THAT(with(8, -4), HasSubstr("cell: 2 over -4 intervals"));
}

TEST(Mrc, SurvivesBreaking) {
  const Scratch scratch;
  survivesBreaking(scratch, "a.mrc", usual(2).header + counting<float>(false));
}

}  // namespace
}  // namespace blockwalk::volume_test
