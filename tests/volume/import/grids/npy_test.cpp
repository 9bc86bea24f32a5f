// SPDX-License-Identifier: Apache-2.0
#include "tests/volume/import/broken.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

std::string npyFile(const std::string& type, const std::string& shape, const std::string& voxels,
                    bool is_fortran = false, int version = 1) {
  std::string text =
      fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': {}, }}", type, is_fortran ? "True" : "False", shape);
  text += std::string(63 - text.size() % 64, ' ') + '\n';
  std::string file = "\x93NUMPY" + std::string(1, static_cast<char>(version)) + '\0';
  for (int i = 0; i < (version == 1 ? 2 : 4); ++i) file += static_cast<char>(text.size() >> (8 * i) & 0xff);
  return file + text + voxels;
}

template <typename T>
std::vector<T> npyCounting(std::size_t count) {
  std::vector<T> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<T>(i);
  return values;
}

TEST(Npy, ReadsTypesInBothByteOrdersAndAllVersions) {
  const Scratch scratch;
  const auto floats = npyCounting<float>(24);
  const auto words = npyCounting<std::uint16_t>(24);
  for (const int version : {1, 2, 3}) {
    const auto little =
        openSource({scratch.write("a.npy", npyFile("<f4", "(2, 3, 4)", bytesOf(floats), false, version))}, {});
    EXPECT_EQ(little->info().dims, glm::ivec3(4, 3, 2));
    EXPECT_EQ(readAll(*little), bytesOf(floats));
  }
  EXPECT_EQ(importAll(scratch.write("a.npy", npyFile(">f4", "(2, 3, 4)", swapped(bytesOf(floats), 4)))),
            bytesOf(floats));
  EXPECT_EQ(importAll(scratch.write("a.npy", npyFile(">u2", "(2,3,4)", swapped(bytesOf(words), 2)))), bytesOf(words));
  EXPECT_EQ(importAll(scratch.write("a.npy", npyFile("|b1", "(2, 3)", "\1\1\1\1\1\1"))), "\1\1\1\1\1\1");
}

// The same array in the other order: voxel by voxel at the same places.
TEST(Npy, FortranOrderIsTheSamePlaces) {
  const Scratch scratch;
  const glm::ivec3 dims(4, 3, 2);
  std::string fortran;
  const auto value = [&](int x, int y, int z) { return static_cast<char>(x + 10 * y + 50 * z); };
  for (int x = 0; x < dims.x; ++x) {
    for (int y = 0; y < dims.y; ++y) {
      for (int z = 0; z < dims.z; ++z) fortran += value(x, y, z);
    }
  }
  ImportOptions options;
  options.spacing = glm::dvec3(5, 2, 3);  // of the axes of the file as they lie: z, y, x
  const auto source = openSource({scratch.write("a.npy", npyFile("|u1", "(2, 3, 4)", fortran, true))}, options);
  ASSERT_EQ(source->info().dims, glm::ivec3(2, 3, 4));
  const std::string all = readAll(*source);
  for (int i = 0; i < 24; ++i) {
    const glm::ivec3 index(i % 2, i / 2 % 3, i / 6);
    const glm::dvec3 world = worldOf(source->info(), glm::dvec3(index) + 0.5);
    const glm::ivec3 place(world / glm::dvec3(3, 2, 5));
    EXPECT_EQ(all[static_cast<std::size_t>(i)], value(place.x, place.y, place.z)) << i;
  }
}

TEST(Npy, FourAxesAreChannelsColoursOrFrames) {
  const Scratch scratch;
  const auto bytes = bytesOf(npyCounting<std::uint8_t>(72));
  const auto planes = openSource({scratch.write("a.npy", npyFile("|u1", "(3, 2, 2, 6)", bytes))}, {});
  EXPECT_EQ(planes->info().channels.size(), 3u);
  EXPECT_EQ(readAll(*planes), bytes);
  const auto colors = openSource({scratch.write("a.npy", npyFile("|u1", "(6, 2, 2, 3)", bytes))}, {});
  EXPECT_EQ(colors->info().type, VoxelType::rgba8);
  EXPECT_EQ(readAll(*colors).substr(0, 8), std::string("\0\1\2\2\3\4\5\5", 8));
  ImportOptions second;
  second.frame = 1;
  const auto film = openSource({scratch.write("a.npy", npyFile("|u1", "(6, 2, 2, 3)", bytes))}, second);
  EXPECT_EQ(film->info().dims, glm::ivec3(3, 2, 2));
  EXPECT_EQ(readAll(*film), bytes.substr(12, 12));
}

TEST(Npy, RefusesByFieldAndBound) {
  const Scratch scratch;
  const auto fault = [&](const std::string& file) { return refusal({scratch.write("a.npy", file)}); };
  EXPECT_THAT(fault(npyFile("<c8", "(2, 3, 4)", "")), HasSubstr("descr: '<c8' cannot be read"));
  EXPECT_THAT(fault(npyFile("<f4", "(2, 3, 4)", "short")), HasSubstr("shape: 96 bytes of values from byte"));
  EXPECT_THAT(fault(npyFile("<f4", "(2, 0, 4)", "")), HasSubstr("shape: '0' is outside 1..65536"));
  EXPECT_THAT(fault(npyFile("<f4", "(65537, 1)", "")), HasSubstr("shape: '65537' is outside"));
  EXPECT_THAT(fault(npyFile("<f4", "(24,)", "")), HasSubstr("shape: 1 axes are outside 2..4"));
  EXPECT_THAT(fault(npyFile("<f4", "24", "")), HasSubstr("shape: is no tuple"));
  EXPECT_THAT(fault(npyFile("<f4", "(2, 2)", std::string(16, 'x'), true)), HasSubstr("fortran_order"));
  EXPECT_THAT(fault(npyFile("<f4", "(2, 2)", "", false, 9)), HasSubstr("version 9 is outside 1..3"));
  std::string records = npyFile("<f4", "(2, 2)", "");
  records.replace(records.find("'<f4'"), 5, "[('a'");
  EXPECT_THAT(fault(records), HasSubstr("structured values"));
}

TEST(Npy, SurvivesBreaking) {
  const Scratch scratch;
  survivesBreaking(scratch, "a.npy", npyFile("<f4", "(2, 3, 4)", bytesOf(npyCounting<float>(24))));
}

}  // namespace
}  // namespace blockwalk::volume_test
