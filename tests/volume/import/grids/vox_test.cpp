// SPDX-License-Identifier: Apache-2.0
#include <glm/glm.hpp>

#include "tests/volume/import/broken.h"
#include "volume/voxel_box.h"

namespace blockwalk::volume_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string int32(std::int32_t value) { return bytesOf<std::int32_t>({value}); }

std::string chunk(const std::string& id, const std::string& content) {
  return id + int32(static_cast<std::int32_t>(content.size())) + int32(0) + content;
}

std::string voxFile(const std::string& chunks) {
  return "VOX " + int32(150) + "MAIN" + int32(0) + int32(static_cast<std::int32_t>(chunks.size())) + chunks;
}

struct Set {
  int x, y, z, color;
};

std::string model(glm::ivec3 dims, const std::vector<Set>& voxels) {
  std::string content = int32(static_cast<std::int32_t>(voxels.size()));
  for (const Set& v : voxels) {
    content += {static_cast<char>(v.x), static_cast<char>(v.y), static_cast<char>(v.z), static_cast<char>(v.color)};
  }
  return chunk("SIZE", int32(dims.x) + int32(dims.y) + int32(dims.z)) + chunk("XYZI", content);
}

// Colour i is i, 2 i, 3 i and opaque.
std::string palette() {
  std::string colors;
  for (int i = 1; i <= 256; ++i)
    colors += {static_cast<char>(i), static_cast<char>(2 * i), static_cast<char>(3 * i), '\xff'};
  return chunk("RGBA", colors);
}

std::string text(const std::string& word) { return int32(static_cast<std::int32_t>(word.size())) + word; }

std::string dict(const std::vector<std::pair<std::string, std::string>>& entries) {
  std::string all = int32(static_cast<std::int32_t>(entries.size()));
  for (const auto& [key, value] : entries) all += text(key) + text(value);
  return all;
}

using Entries = std::vector<std::pair<std::string, std::string>>;

std::string transform(int id, int child, const Entries& frame, const Entries& attributes = {}, int layer = 0) {
  return chunk("nTRN", int32(id) + dict(attributes) + int32(child) + int32(-1) + int32(layer) + int32(1) + dict(frame));
}
std::string group(int id, const std::vector<int>& children) {
  std::string content = int32(id) + dict({}) + int32(static_cast<std::int32_t>(children.size()));
  for (const int child : children) content += int32(child);
  return chunk("nGRP", content);
}
std::string shape(int id, int model_id) {
  return chunk("nSHP", int32(id) + dict({}) + int32(1) + int32(model_id) + dict({}));
}

// Places that are set, with the red of their colours.
std::vector<std::array<int, 4>> setIn(Source& source) {
  const std::string all = readAll(source, 1);
  const glm::ivec3 dims = source.info().dims;
  std::vector<std::array<int, 4>> found;
  for (int i = 0; i < dims.x * dims.y * dims.z; ++i) {
    const auto at = static_cast<std::size_t>(4 * i);
    if (all[at + 3] != 0)
      found.push_back({i % dims.x, i / dims.x % dims.y, i / (dims.x * dims.y), static_cast<unsigned char>(all[at])});
  }
  return found;
}

using At = std::array<int, 4>;

TEST(Vox, HasColoursPlaceAndBlankSpace) {
  const Scratch scratch;
  const auto path =
      scratch.write("a.vox", voxFile(model({40, 5, 6}, {{1, 2, 3, 7}, {30, 4, 5, 80}, {2, 2, 3, 7}}) + palette()));
  const auto source = openSource({path}, {});
  EXPECT_EQ(source->info().type, VoxelType::rgba8);
  EXPECT_EQ(source->info().dims, glm::ivec3(40, 5, 6));
  EXPECT_THAT(setIn(*source), ElementsAre(At{1, 2, 3, 7}, At{2, 2, 3, 7}, At{30, 4, 5, 80}));
  const std::string row = [&] {
    std::string bytes(160, '\0');
    source->readRows(3, 2, 1, std::as_writable_bytes(std::span(bytes)));
    return bytes.substr(4, 4);
  }();
  EXPECT_EQ(row, "\7\16\25\xff");
  // What is up there, z, is up in the world: y.
  EXPECT_EQ(glm::dvec3(source->info().world_from_index[2]), glm::dvec3(0, 1, 0));
  EXPECT_GT(glm::determinant(source->info().world_from_index), 0);
  std::vector<VoxelRun> runs;
  source->findRuns({.begin = {0, 0, 0}, .end = {40, 5, 6}}, runs);
  EXPECT_THAT(runs, ElementsAre(VoxelRun{1, 3}, VoxelRun{30, 31}));
  source->findRuns({.begin = {3, 0, 0}, .end = {40, 5, 5}}, runs);
  EXPECT_THAT(runs, IsEmpty());
}

TEST(Vox, LargeBoxesFindWhatIsSet) {
  const Scratch scratch;
  const auto source = openSource({scratch.write("a.vox", voxFile(model({30, 100, 100}, {{9, 50, 60, 1}})))}, {});
  std::vector<VoxelRun> runs;
  source->findRuns({.begin = {0, 0, 0}, .end = {30, 100, 100}}, runs);
  EXPECT_THAT(runs, ElementsAre(VoxelRun{0, 30}));
  source->findRuns({.begin = {0, 0, 61}, .end = {30, 100, 100}}, runs);
  EXPECT_THAT(runs, IsEmpty());
  source->findRuns({.begin = {0, 51, 0}, .end = {30, 100, 61}}, runs);
  EXPECT_THAT(runs, IsEmpty());
}

TEST(Vox, FilesWithoutPaletteHaveTheUsualOne) {
  const Scratch scratch;
  const auto path = scratch.write(
      "a.vox",
      voxFile(model({6, 1, 1},
                    {{0, 0, 0, 1}, {1, 0, 0, 2}, {2, 0, 0, 37}, {3, 0, 0, 216}, {4, 0, 0, 226}, {5, 0, 0, 255}})));
  EXPECT_EQ(importAll(path),
            "\xff\xff\xff\xff"
            "\xff\xff\xcc\xff"
            "\xcc\xff\xff\xff" +
                std::string("\xee\0\0\xff"
                            "\0\xee\0\xff"
                            "\x11\x11\x11\xff",
                            12));
}

TEST(Vox, ScenesPlaceAndTurnModels) {
  const Scratch scratch;
  // Row 0 takes y negated, row 1 takes x: a quarter turn about z.
  const std::string quarter = std::to_string(1 | 0 << 2 | 1 << 4);
  const std::string models =
      model({3, 1, 1}, {{0, 0, 0, 10}, {2, 0, 0, 12}}) + model({2, 2, 2}, {{0, 0, 0, 20}, {1, 1, 1, 21}});
  const std::string nodes = transform(0, 1, {}) + group(1, {2, 4}) +
                            transform(2, 3, {{"_r", quarter}, {"_t", "5 0 0"}}) + shape(3, 0) +
                            transform(4, 5, {{"_t", "0 0 9"}}) + shape(5, 1);
  const auto source = openSource({scratch.write("a.vox", voxFile(models + nodes + palette()))}, {});
  // The row of three turns about its middle, from x into y: x 5 - 1, y -1..1, z 0. The cube has x, y -1..0 and z 8..9.
  EXPECT_EQ(source->info().dims, glm::ivec3(6, 3, 10));
  EXPECT_THAT(setIn(*source), ElementsAre(At{5, 0, 0, 10}, At{5, 2, 0, 12}, At{0, 0, 8, 20}, At{1, 1, 9, 21}));
  EXPECT_THAT(source->info().notes, IsEmpty());
}

TEST(Vox, TheLastModelWinsAndHiddenOnesAreLeftOut) {
  const Scratch scratch;
  const std::string models =
      model({1, 1, 1}, {{0, 0, 0, 10}}) + model({1, 1, 1}, {{0, 0, 0, 20}}) + model({1, 1, 1}, {{0, 0, 0, 30}});
  const std::string nodes = transform(0, 1, {}) + group(1, {2, 4, 6, 8}) + transform(2, 3, {}) + shape(3, 0) +
                            transform(4, 5, {}) + shape(5, 1) + transform(6, 7, {}, {{"_hidden", "1"}}) + shape(7, 2) +
                            transform(8, 9, {}, {}, 3) + shape(9, 2) +
                            chunk("LAYR", int32(3) + dict({{"_hidden", "1"}}) + int32(-1));
  const auto source = openSource({scratch.write("a.vox", voxFile(models + nodes + palette()))}, {});
  EXPECT_THAT(setIn(*source), ElementsAre(At{0, 0, 0, 20}));
  EXPECT_THAT(source->info().notes, testing::Contains(HasSubstr("hidden parts of the scene are left out")));
}

TEST(Vox, ModelsWithoutASceneAreSteps) {
  const Scratch scratch;
  const auto path = scratch.write(
      "a.vox", voxFile(model({1, 1, 1}, {{0, 0, 0, 10}}) + model({2, 1, 1}, {{1, 0, 0, 20}}) + palette()));
  EXPECT_THAT(openSource({path}, {})->info().notes,
              testing::Contains(HasSubstr("of the 2 models it is number 0; --frame chooses")));
  ImportOptions second;
  second.frame = 1;
  EXPECT_THAT(setIn(*openSource({path}, second)), ElementsAre(At{1, 0, 0, 20}));
  second.frame = 2;
  EXPECT_THAT(refusal({path}, second), HasSubstr("frame 2 is asked for, there are 2"));
}

TEST(Vox, BrokenFilesAreRefusedByNameAndBound) {
  const Scratch scratch;
  const auto refusalOf = [&](const std::string& chunks) { return refusal({scratch.write("a.vox", voxFile(chunks))}); };
  EXPECT_THAT(refusalOf(""), HasSubstr("a.vox: XYZI: is missing"));
  EXPECT_THAT(refusalOf(model({1, 1, 1}, {{0, 0, 1, 1}})), HasSubstr("XYZI: voxel 0 at 0,0,1 lies outside 1 x 1 x 1"));
  EXPECT_THAT(refusalOf(model({1, 257, 1}, {})), HasSubstr("SIZE: 257 is outside 1..256"));
  EXPECT_THAT(refusalOf(chunk("SIZE", int32(1) + int32(1) + int32(1)) + chunk("XYZI", int32(9))),
              HasSubstr("XYZI: 9 entries are declared, 0 bytes are left"));
  const std::string one = model({1, 1, 1}, {{0, 0, 0, 1}});
  EXPECT_THAT(refusalOf(one + transform(0, 0, {})), HasSubstr("nodes are nested more than 64 times"));
  EXPECT_THAT(refusalOf(one + transform(0, 7, {})), HasSubstr("node 7 is not there"));
  EXPECT_THAT(refusalOf(one + transform(0, 1, {}) + shape(1, 5)), HasSubstr("nSHP: model 5 is asked for, there are 1"));
  EXPECT_THAT(refusalOf(one + transform(0, 1, {{"_r", "0"}}) + shape(1, 0)), HasSubstr("_r: 0 is no rotation"));
  EXPECT_THAT(refusalOf(one + transform(0, 1, {{"_t", "1 2"}}) + shape(1, 0)),
              HasSubstr("_t: '1 2' must be three whole numbers"));
  // Thirty groups of two: a thousand million of models.
  std::string doubling = one;
  for (int i = 0; i < 30; ++i) doubling += group(i, {i + 1, i + 1});
  EXPECT_THAT(refusalOf(doubling + shape(30, 0)), HasSubstr("the scene has more than 1048576 nodes"));
  std::string far = one + transform(0, 1, {}) + group(1, {2, 4}) + transform(2, 3, {}) + shape(3, 0) +
                    transform(4, 3, {{"_t", "70000 0 0"}});
  EXPECT_THAT(refusalOf(far), HasSubstr("size of the scene: 70001 is outside 1..65536"));
}

TEST(Vox, SurvivesBreaking) {
  const Scratch scratch;
  survivesBreaking(scratch, "a.vox",
                   voxFile(model({3, 3, 3}, {{0, 0, 0, 1}, {2, 1, 0, 4}}) + transform(0, 1, {}) + group(1, {2, 4}) +
                           transform(2, 3, {{"_r", "4"}, {"_t", "1 2 3"}}) + shape(3, 0) + transform(4, 3, {})));
}

TEST(Vox, RealModelsOpen) {
  const auto data = realData();
  if (!data || !std::filesystem::is_directory(*data / "voxel_rgba")) GTEST_SKIP() << "no data";
  const auto countOf = [&](const char* name) { return setIn(*openSource({*data / "voxel_rgba" / name}, {})).size(); };
  EXPECT_EQ(countOf("monu1.vox"), 156942u);
  EXPECT_EQ(countOf("monu0.vox"), 12717u);
  EXPECT_EQ(countOf("dragon.vox"), 40265u);
  EXPECT_EQ(countOf("T-Rex.vox"), 1272u);
}

}  // namespace
}  // namespace blockwalk::volume_test
