// SPDX-License-Identifier: Apache-2.0
#include <glm/glm.hpp>

#include "tests/volume/import/broken.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

// Slabs of columns, x after x: 2 x 3 columns.
std::string kvxFile(const std::vector<std::string>& columns, int depth = 9) {
  std::vector<std::uint32_t> of_x;
  std::vector<std::uint16_t> of_xy;
  std::string slabs;
  const std::uint32_t tables = 4 * 3 + 2 * 2 * 4;
  for (std::size_t x = 0; x < 2; ++x) {
    of_x.push_back(tables + static_cast<std::uint32_t>(slabs.size()));
    const std::size_t begin = slabs.size();
    for (std::size_t y = 0; y < 3; ++y) {
      of_xy.push_back(static_cast<std::uint16_t>(slabs.size() - begin));
      slabs += columns[3 * x + y];
    }
    of_xy.push_back(static_cast<std::uint16_t>(slabs.size() - begin));
  }
  of_x.push_back(tables + static_cast<std::uint32_t>(slabs.size()));
  const std::string body = bytesOf<std::int32_t>({2, 3, depth, 0, 0, 0}) + bytesOf(of_x) + bytesOf(of_xy) + slabs;
  std::string palette;
  for (int i = 0; i < 256; ++i) palette += {static_cast<char>(i / 4), '\x3f', '\0'};
  return bytesOf<std::uint32_t>({static_cast<std::uint32_t>(body.size())}) + body + palette;
}

const std::vector<std::string> kColumns = {std::string("\x02\x01\x3f"
                                                       "\x08",
                                                       4),
                                           "",
                                           "",
                                           std::string("\x00\x02\x3f"
                                                       "\x10\x14"
                                                       "\x07\x01\x3f"
                                                       "\xff",
                                                       9),
                                           "",
                                           std::string("\x08\x01\x3f"
                                                       "\x0c",
                                                       4)};

TEST(Kvx, HasColoursAndPlaces) {
  const Scratch scratch;
  const auto source = openSource({scratch.write("a.kvx", kvxFile(kColumns))}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(2, 3, 9));
  EXPECT_GT(glm::determinant(source->info().world_from_index), 0);
  EXPECT_EQ(glm::dvec3(source->info().world_from_index[2]), glm::dvec3(0, -1, 0));
  std::string wanted(std::size_t{2} * 3 * 9 * 4, '\0');
  const auto set = [&](int x, int y, int z, const std::string& color) {
    wanted.replace(static_cast<std::size_t>(4 * ((z * 3 + y) * 2 + x)), 4, color);
  };
  set(0, 0, 2, std::string("\x08\xff\0\xff", 4));
  set(1, 0, 0, std::string("\x10\xff\0\xff", 4));
  set(1, 0, 1, std::string("\x14\xff\0\xff", 4));
  set(1, 0, 7, std::string("\xff\xff\0\xff", 4));
  set(1, 2, 8, std::string("\x0c\xff\0\xff", 4));
  EXPECT_EQ(readAll(*source), wanted);
}

TEST(Kvx, BrokenFilesAreRefusedByNameAndBound) {
  const Scratch scratch;
  std::vector<std::string> columns = kColumns;
  columns[5] = std::string(
      "\x08\x02\x3f"
      "ab",
      5);
  EXPECT_THAT(refusal({scratch.write("a.kvx", kvxFile(columns))}),
              HasSubstr("a.kvx: column 1,2: a slab of 2 from 8 leaves 9"));
  columns[5] = std::string(
      "\x08\x02\x3f"
      "a",
      4);
  EXPECT_THAT(refusal({scratch.write("a.kvx", kvxFile(columns))}), HasSubstr("column 1,2: a slab at byte"));
  std::string file = kvxFile(kColumns);
  file[40 + 14] = '\x7f';
  EXPECT_THAT(refusal({scratch.write("a.kvx", file)}), HasSubstr("column 1,2: bytes"));
  EXPECT_THAT(refusal({scratch.write("a.kvx", kvxFile(kColumns, 300))}), HasSubstr("is no file of a known format"));
}

TEST(Kvx, SurvivesBreaking) {
  const Scratch scratch;
  survivesBreaking(scratch, "a.kvx", kvxFile(kColumns));
}

}  // namespace
}  // namespace blockwalk::volume_test
