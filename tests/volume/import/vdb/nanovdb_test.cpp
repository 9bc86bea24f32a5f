// SPDX-License-Identifier: Apache-2.0
// Files that NanoVDB's own headers write.
#include <gtest/gtest.h>

#include "tests/volume/import/import_scratch.h"

#ifdef BLOCKWALK_NANOVDB
#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC
#include <nanovdb/util/GridBuilder.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/Primitives.h>

#include "tests/volume/import/broken.h"
#include "volume/formats/nano_layout.h"

namespace blockwalk::volume_test {
namespace {

using nanovdb::Coord;
using testing::Contains;
using testing::HasSubstr;

using Handle = nanovdb::GridHandle<nanovdb::HostBuffer>;

std::filesystem::path save(const Scratch& scratch, const Handle& handle,
                           nanovdb::io::Codec codec = nanovdb::io::Codec::NONE) {
  auto path = scratch.path("a.nvdb");
  std::filesystem::remove(path);
  nanovdb::io::writeGrid(path.string(), handle, codec);
  return path;
}

std::string bytesIn(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Component `c` of a value as a float.
template <typename Value>
float componentOf(const Value& value, int c) {
  if constexpr (std::is_arithmetic_v<Value>) {
    return static_cast<float>(value);
  } else {
    return static_cast<float>(value[c]);
  }
}

// Every voxel is what the tree has for it, at its place. `valueOf(value, component)` where it is active.
template <typename BuildT, typename Value>
void expectSame(Source& source, const Handle& handle, Value valueOf, bool inside_only = false) {
  const auto* grid = handle.grid<BuildT>();
  ASSERT_NE(grid, nullptr);
  const SourceInfo& info = source.info();
  const std::string all = readAll(source);
  const auto to_index = glm::inverse(info.world_from_index);
  const auto box = grid->indexBBox();
  // Where the source begins, in the file's index space.
  const auto world = grid->indexToWorld(nanovdb::Vec3d(box.min()[0], box.min()[1], box.min()[2]));
  const glm::dvec3 first = glm::dvec3(to_index * glm::dvec4(world[0], world[1], world[2], 1)) - 0.5;
  const glm::ivec3 offset(glm::round(first));
  EXPECT_LT(glm::length(first - glm::dvec3(offset)), 1e-6);
  if (!inside_only) {
    EXPECT_EQ(offset, glm::ivec3(0));
    EXPECT_EQ(info.dims, glm::ivec3(box.dim()[0], box.dim()[1], box.dim()[2]));
  }
  const auto access = grid->getAccessor();
  const std::size_t bytes = voxelBytes(info.type);
  const bool is_color = info.type == VoxelType::rgba8;
  const std::size_t plane = all.size() / info.channels.size();
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < plane / bytes; ++i) {
    const auto width = static_cast<std::size_t>(info.dims.x);
    const auto height = static_cast<std::size_t>(info.dims.y);
    const Coord voxel =
        box.min() + Coord(static_cast<int>(i % width) - offset.x, static_cast<int>(i / width % height) - offset.y,
                          static_cast<int>(i / width / height) - offset.z);
    const auto value = access.getValue(voxel);
    for (std::size_t c = 0; c < (is_color ? 4 : info.channels.size()); ++c) {
      float got = 0;
      if (is_color || bytes == 1) {
        got = static_cast<float>(static_cast<unsigned char>(all[is_color ? i * 4 + c : c * plane + i]));
      } else if (bytes == 2) {
        std::uint16_t stored = 0;
        std::memcpy(&stored, &all[c * plane + i * 2], 2);
        got = static_cast<float>(info.channels[0].value_offset + stored);
      } else {
        std::memcpy(&got, &all[c * plane + i * bytes], bytes);
      }
      if (got != valueOf(value, static_cast<int>(c), access.isActive(voxel))) ++wrong;
    }
  }
  EXPECT_EQ(wrong, 0u);
}

constexpr auto kSame = [](const auto& value, int c, bool is_active) { return is_active ? componentOf(value, c) : 0; };

template <typename ValueT, typename BuildT = ValueT, typename Make>
void expectKept(Make make) {
  const Scratch scratch;
  nanovdb::GridBuilder<ValueT, BuildT> builder(ValueT{});
  auto access = builder.getAccessor();
  for (int i = 1; i < 400; ++i) access.setValue(Coord(i * 7 % 31 - 9, i * 5 % 23 - 200, i * 3 % 29 + 4090), make(i));
  const Handle handle = builder.getHandle(0.5, nanovdb::Vec3d(1, -2, 3), "some");
  for (const auto codec : {nanovdb::io::Codec::NONE, nanovdb::io::Codec::ZIP, nanovdb::io::Codec::BLOSC}) {
    const auto source = openSource({save(scratch, handle, codec)}, {});
    EXPECT_EQ(source->info().format, "nanovdb");
    expectSame<BuildT>(*source, handle, kSame);
    expectSame<BuildT>(*source->another(), handle, kSame);
  }
}

TEST(NanoVdb, ValuesOfAllTypesAreKept) {
  expectKept<float>([](int i) { return static_cast<float>(i) / 3; });
  expectKept<double>([](int i) { return static_cast<double>(i); });
  expectKept<std::int16_t>([](int i) { return static_cast<std::int16_t>(i - 200); });
  expectKept<std::int32_t>([](int i) { return i - 50; });
  expectKept<std::int64_t>([](int i) { return std::int64_t{i} << 20; });
  expectKept<std::uint32_t>([](int i) { return static_cast<std::uint32_t>(i) << 12; });
  expectKept<nanovdb::Vec3f>([](int i) { return nanovdb::Vec3f(1.0f, static_cast<float>(i), 0.5f); });
  expectKept<nanovdb::Vec3d>([](int i) { return nanovdb::Vec3d(i, 2, -i); });
  expectKept<nanovdb::Vec4f>([](int i) { return nanovdb::Vec4f(1.0f, static_cast<float>(i), 0.5f, 7.0f); });
  expectKept<nanovdb::Rgba8>([](int i) {
    return nanovdb::Rgba8(static_cast<std::uint8_t>(i), 3, 200, static_cast<std::uint8_t>(1 + i % 255));
  });
  expectKept<float, nanovdb::Fp4>([](int i) { return static_cast<float>(i) / 3; });
  expectKept<float, nanovdb::Fp8>([](int i) { return static_cast<float>(i) / 3; });
  expectKept<float, nanovdb::Fp16>([](int i) { return static_cast<float>(i) / 3; });
  expectKept<float, nanovdb::FpN>([](int i) { return static_cast<float>(i) / 3; });
}

TEST(NanoVdb, TilesAreCubesOfOneValue) {
  const Scratch scratch;
  const Handle box = nanovdb::createFogVolumeBox<float>(90, 70, 80, nanovdb::Vec3f(3, 5, 7));
  const auto source = openSource({save(scratch, box)}, {});
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("cubes of one value")));
  expectSame<float>(*source, box, kSame);
  // Inside a cube nothing is stored, and all of it is found.
  std::vector<VoxelRun> runs;
  source->findRuns({.begin = source->info().dims / 2, .end = source->info().dims / 2 + 4}, runs);
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].end - runs[0].begin, 4);
}

TEST(NanoVdb, LevelSetsBecomeFog) {
  const Scratch scratch;
  const Handle sphere =
      nanovdb::createLevelSetSphere<float>(30, nanovdb::Vec3f(0), 1.0, 3.0, nanovdb::Vec3d(0), "ball");
  const auto source = openSource({save(scratch, sphere)}, {});
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("'ball' is a level set")));
  const float weight = 1.0f / -3.0f;
  const auto fog = [&](float value, int, bool) { return value < 0 ? value * weight : 0.0f; };
  expectSame<float>(*source, sphere, fog, true);
}

TEST(NanoVdb, OneGridAloneIsReadAndSeveralAreChannels) {
  const Scratch scratch;
  const Handle ball = nanovdb::createFogVolumeSphere<float>(9, nanovdb::Vec3f(0), 1, 3, nanovdb::Vec3d(0), "ball");
  const auto bare =
      scratch.write("bare.nvdb", std::string_view(reinterpret_cast<const char*>(ball.data()), ball.size()));
  expectSame<float>(*openSource({bare}, {}), ball, kSame);
  std::vector<Handle> handles;
  handles.push_back(nanovdb::createFogVolumeSphere<float>(9, nanovdb::Vec3f(0), 1, 3, nanovdb::Vec3d(0), "ball"));
  handles.push_back(nanovdb::createFogVolumeBox<float>(20, 10, 10, nanovdb::Vec3f(0), 1, 3, nanovdb::Vec3d(0), "box"));
  const auto path = scratch.path("two.nvdb");
  nanovdb::io::writeGrids(path.string(), handles, nanovdb::io::Codec::BLOSC);
  const auto both = openSource({path}, {});
  ASSERT_EQ(both->info().channels.size(), 2u);
  EXPECT_EQ(both->info().channels[1].name, "box");
  ImportOptions options;
  options.dataset = "box";
  EXPECT_EQ(openSource({path}, options)->info().channels.size(), 1u);
  options.dataset = "1";
  expectSame<float>(*openSource({path}, options), handles[0], kSame);
}

// Newer headers mark files and grids with other digits, and change nothing that is read.
TEST(NanoVdb, NewerMarksAreKnown) {
  const Scratch scratch;
  const Handle ball = nanovdb::createFogVolumeSphere<float>(9);
  std::string file = bytesIn(save(scratch, ball));
  const std::size_t grid = file.find("NanoVDB0", 8);
  ASSERT_NE(grid, std::string::npos);
  file[7] = '2';
  file[grid + 7] = '1';
  expectSame<float>(*openSource({scratch.write("b.nvdb", file)}, {}), ball, kSame);
  expectSame<float>(*openSource({scratch.write("c.nvdb", file.substr(grid))}, {}), ball, kSame);
}

TEST(NanoVdb, WhatIsNoVolumeIsRefusedByName) {
  const Scratch scratch;
  std::string file = bytesIn(save(scratch, nanovdb::createFogVolumeSphere<float>(9)));
  const auto refusalWith = [&](std::size_t at, std::uint32_t word) {
    std::string broken = file;
    std::memcpy(&broken[at], &word, 4);
    return refusal({scratch.write("b.nvdb", broken)});
  };
  const std::size_t grid = file.find("NanoVDB0", 8);
  EXPECT_THAT(refusalWith(grid + nano::grid::kType, 19), HasSubstr("of Index: values of this type are not read"));
  EXPECT_THAT(refusalWith(grid + nano::grid::kVersion, 31u << 21), HasSubstr("version: 31 is not 32"));
  EXPECT_THAT(refusalWith(grid + nano::grid::kBytes + 24, 0x7fffff00), HasSubstr("are asked for, it has"));
  EXPECT_THAT(refusalWith(16 + nano::record::kFileBytes, 7), HasSubstr("fileSize: 7 bytes, must be its"));
  EXPECT_THAT(refusalWith(16 + nano::record::kNameBytes, 1 << 20), HasSubstr("nameSize: 1048576 bytes"));
  ImportOptions options;
  options.memory_bytes = 1 << 17;
  EXPECT_THAT(refusal({save(scratch, nanovdb::createFogVolumeSphere<float>(40), nanovdb::io::Codec::ZIP)}, options),
              HasSubstr("an eighth of --memory"));
  EXPECT_THAT(refusal({save(scratch, nanovdb::createFogVolumeSphere<float>(40))}, options),
              HasSubstr("take more than 131072 bytes of memory"));
}

TEST(NanoVdb, SurvivesBreaking) {
  const Scratch scratch;
  // In one node of each size but leaves.
  const Handle sphere = nanovdb::createLevelSetSphere<float>(9, nanovdb::Vec3f(60));
  for (const auto codec : {nanovdb::io::Codec::NONE, nanovdb::io::Codec::ZIP}) {
    survivesBreakingInBounds(scratch, "b.nvdb", bytesIn(save(scratch, sphere, codec)));
  }
}

template <typename BuildT>
constexpr bool layoutFits(const nano::ValueSizes& value, std::size_t leaf_table) {
  constexpr std::size_t kRoot = sizeof(typename nanovdb::NanoRoot<BuildT>);
  const nano::Layout layout = nano::layoutOf(value, leaf_table);
  return layout.root_bytes == kRoot && layout.upper.bytes == sizeof(nanovdb::NanoUpper<BuildT>) &&
         layout.lower.bytes == sizeof(nanovdb::NanoLower<BuildT>) &&
         layout.leaf_bytes == sizeof(nanovdb::NanoLeaf<BuildT>) &&
         layout.tile_bytes == sizeof(typename nanovdb::NanoRoot<BuildT>::DataType::Tile);
}
static_assert(layoutFits<float>({4, 4, 4}, 2048));
static_assert(layoutFits<double>({8, 8, 8}, 4096));
static_assert(layoutFits<std::int16_t>({2, 2, 4}, 1024));
static_assert(layoutFits<std::int64_t>({8, 8, 8}, 4096));
static_assert(layoutFits<nanovdb::Vec3f>({12, 4, 4}, 6144));
static_assert(layoutFits<nanovdb::Vec3d>({24, 8, 8}, 12288));
static_assert(layoutFits<nanovdb::Vec4f>({16, 4, 4}, 8192));
static_assert(layoutFits<nanovdb::Rgba8>({4, 4, 4}, 2048));
static_assert(layoutFits<nanovdb::Fp8>({4, 4, 4}, 512));
static_assert(sizeof(nanovdb::GridData) == nano::grid::kBytes && sizeof(nanovdb::TreeData<3>) == nano::tree::kBytes);
static_assert(offsetof(nanovdb::GridData, mMap) == nano::grid::kMapFloats &&
              offsetof(nanovdb::GridData, mGridType) == nano::grid::kType);

}  // namespace
}  // namespace blockwalk::volume_test

#else

namespace blockwalk::volume_test {
namespace {

TEST(NanoVdb, IsRead) { GTEST_SKIP() << "built without the headers of NanoVDB, which make the files"; }

}  // namespace
}  // namespace blockwalk::volume_test

#endif
