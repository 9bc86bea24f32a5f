// SPDX-License-Identifier: Apache-2.0
// Files that OpenVDB writes, and what it reads of real ones.
#include <gtest/gtest.h>

#include "tests/volume/import/import_scratch.h"

#ifdef BLOCKWALK_OPENVDB
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointCount.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/LevelSetUtil.h>
#ifdef BLOCKWALK_NANOVDB
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#endif

#include <numeric>

#include "tests/volume/import/vdb/vdb_files.h"
#include "volume/build/builder.h"
#include "volume/file/file.h"

namespace blockwalk::volume_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

class Vdb : public VdbTest {};

// The source's single channel is what the accessor reads of the grid, its box the box of active voxels, its places
// those of the transform.
template <typename GridT, typename Value>
void expectSame(Source& source, const GridT& grid, Value valueOf) {
  const SourceInfo& info = source.info();
  const auto box = grid.evalActiveVoxelBoundingBox();
  ASSERT_EQ(info.dims, glm::ivec3(box.dim().x(), box.dim().y(), box.dim().z()));
  const std::string all = readAll(source);
  const auto access = grid.getConstAccessor();
  const std::size_t bytes = voxelBytes(info.type);
  std::size_t at = 0;
  std::size_t wrong = 0;
  for (int z = 0; z < info.dims.z; ++z) {
    for (int y = 0; y < info.dims.y; ++y) {
      for (int x = 0; x < info.dims.x; ++x, at += bytes) {
        const Coord voxel = box.min() + Coord(x, y, z);
        float got = 0;
        if (bytes == 4) std::memcpy(&got, &all[at], 4);
        if (bytes == 1) got = static_cast<float>(static_cast<unsigned char>(all[at]));
        const auto value = access.isValueOn(voxel) ? access.getValue(voxel) : grid.background();
        if (got != valueOf(value)) ++wrong;
      }
    }
  }
  EXPECT_EQ(wrong, 0u);
  const auto centre = grid.indexToWorld(box.min());
  const glm::dvec3 apart = worldOf(info, glm::dvec3(0.5)) - glm::dvec3(centre.x(), centre.y(), centre.z());
  EXPECT_LT(glm::length(apart), 1e-9);
  const auto far = grid.indexToWorld(box.max());
  const glm::dvec3 far_apart = worldOf(info, glm::dvec3(info.dims) - 0.5) - glm::dvec3(far.x(), far.y(), far.z());
  EXPECT_LT(glm::length(far_apart), 1e-9);
}

float same(float value) { return value; }

TEST_F(Vdb, FloatsKeepValuesAndPlace) {
  auto grid = someFloats();
  openvdb::math::Mat4d place = openvdb::math::Mat4d::identity();
  place.preScale(openvdb::Vec3d(0.5, 0.25, 2));
  place.postRotate(openvdb::math::Z_AXIS, 0.4);
  place.postTranslate(openvdb::Vec3d(10, -20, 30));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(place));
  const auto source = open({grid});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.format, "vdb");
  EXPECT_EQ(info.type, VoxelType::f32);
  EXPECT_EQ(info.blank, std::vector<std::byte>(4));
  EXPECT_THAT(info.facts, Contains(std::pair<std::string, std::string>("grid", "density")));
  EXPECT_THAT(info.facts, Contains(std::pair<std::string, std::string>("creator", "a test")));
  EXPECT_THAT(info.notes, ElementsAre(HasSubstr("512 of its 942 active voxels lie in 1 cubes")));
  expectSame(*source, *grid, same);
  expectSame(*source->another(), *grid, same);
}

TEST_F(Vdb, CompressionsAreUnpacked) {
  auto grid = someFloats();
  for (const std::uint32_t compression :
       {std::uint32_t{openvdb::io::COMPRESS_NONE}, std::uint32_t{openvdb::io::COMPRESS_ZIP},
        std::uint32_t{openvdb::io::COMPRESS_BLOSC},
        std::uint32_t{openvdb::io::COMPRESS_BLOSC} | std::uint32_t{openvdb::io::COMPRESS_ACTIVE_MASK}}) {
    expectSame(*openSource({save({grid}, compression)}, {}), *grid, same);
  }
  grid->setSaveFloatAsHalf(true);
  const auto path = save({grid});
  openvdb::io::File file(path.string());
  file.open(false);
  const auto half = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("density"));
  expectSame(*openSource({path}, {}), *half, same);
}

template <typename GridT, typename Value>
void fillSome(GridT& grid, Value valueOf) {
  auto access = grid.getAccessor();
  for (int i = 0; i < 90; ++i) access.setValue(Coord(i % 7, i % 11, i % 5), valueOf(i));
}

TEST_F(Vdb, NumbersOfOtherTypes) {
  auto doubles = named<openvdb::DoubleGrid>("d", 0);
  fillSome(*doubles, [](int i) { return i / 3.0; });
  const auto source = open({doubles});
  expectSame(*source, *doubles, [](double value) { return static_cast<float>(value); });
  EXPECT_GT(source->conversion(0).largest_rounding, 0);
  auto ints = named<openvdb::Int32Grid>("i", -7);
  fillSome(*ints, [](int i) { return i - 40; });
  expectSame(*open({ints}), *ints, [](std::int32_t value) { return static_cast<float>(value); });
  auto longs = named<openvdb::Int64Grid>("l", 0);
  fillSome(*longs, [](int i) { return std::int64_t{1} << (i % 60); });
  expectSame(*open({longs}), *longs, [](std::int64_t value) { return static_cast<float>(value); });
  auto bools = named<openvdb::BoolGrid>("b", false);
  fillSome(*bools, [](int i) { return i % 3 == 0; });
  const auto bits = open({bools});
  EXPECT_EQ(bits->info().type, VoxelType::u8);
  expectSame(*bits, *bools, [](bool value) { return value ? 1.0f : 0.0f; });
  auto mask = openvdb::MaskGrid::create();
  fillSome(*mask, [](int) { return true; });
  mask->tree().addTile(1, Coord(8, 8, 0), true, true);
  const auto masked = open({mask});
  EXPECT_EQ(masked->info().dims, glm::ivec3(16, 16, 8));
  const auto all = readAll(*masked);
  EXPECT_EQ(static_cast<std::uint64_t>(std::ranges::count(all, '\1')), mask->activeVoxelCount());
}

TEST_F(Vdb, VectorsAreChannelsOrAColorByWish) {
  auto vectors = named<openvdb::Vec3SGrid>("v", openvdb::Vec3s(0));
  vectors->getAccessor().setValue(Coord(1, 2, 3), openvdb::Vec3s(0.25f, 1, 4));
  const auto source = open({vectors});
  ASSERT_EQ(source->info().channels.size(), 3u);
  EXPECT_EQ(source->info().channels[2].name, "v.z");
  EXPECT_EQ(readAll(*source), bytesOf<float>({0.25f, 1, 4}));
  ImportOptions options;
  options.channels = ChannelRule::color;
  const auto color = open({vectors}, options);
  EXPECT_EQ(color->info().type, VoxelType::rgba8);
  EXPECT_EQ(readAll(*color), "\x10\x40\xff\xff");  // 0..4 is 0..255, density the largest of them
}

TEST_F(Vdb, LevelSetsBecomeFog) {
  for (const float radius : {6.0f, 30.0f}) {
    auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(radius, openvdb::Vec3f(1, 2, 3), 0.5f);
    sphere->setName("surface");
    const auto source = open({sphere});
    EXPECT_THAT(source->info().notes, Contains(HasSubstr("'surface' is a level set")));
    openvdb::tools::sdfToFogVolume(*sphere);
    expectSame(*source, *sphere, same);
  }
}

TEST_F(Vdb, AColorWithItsDensityIsOneVolume) {
  auto color = named<openvdb::Vec3SGrid>("albedo", openvdb::Vec3s(0));
  auto density = named<openvdb::FloatGrid>("density", 0);
  color->getAccessor().setValue(Coord(0, 0, 0), openvdb::Vec3s(1, 0.5f, 0));
  color->getAccessor().setValue(Coord(1, 0, 0), openvdb::Vec3s(0.2f, -1, 0.4f));
  density->getAccessor().setValue(Coord(1, 0, 0), 5);
  density->getAccessor().setValue(Coord(2, 0, 0), 0.001f);
  const auto source = open({color, density});
  EXPECT_EQ(source->info().dims, glm::ivec3(3, 1, 1));
  EXPECT_EQ(source->info().type, VoxelType::rgba8);
  EXPECT_EQ(readAll(*source), std::string("\xff\x80\0\0\x33\0\x66\xff\0\0\0\1", 12));
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("0..5 are 0..255")));
  ImportOptions options;
  options.channels = ChannelRule::fields;
  EXPECT_EQ(open({color, density}, options)->info().channels.size(), 4u);
  auto doubles = named<openvdb::DoubleGrid>("density", 0);
  doubles->getAccessor().setValue(Coord(0, 0, 0), 0.5);
  EXPECT_EQ(readAll(*open({doubles, color})), std::string("\xff\x80\0\xff\x33\0\x66\0", 8));
  EXPECT_THAT(refusalOf({doubles, color}, options), HasSubstr("as fields they must be of one type"));
  options.channels = ChannelRule::automatic;
  options.dataset = "density";
  EXPECT_EQ(open({color, density}, options)->info().type, VoxelType::f32);
}

TEST_F(Vdb, GridsOfOnePlaceAreChannelsAndOthersAreListed) {
  auto heat = named<openvdb::FloatGrid>("heat", 0);
  heat->getAccessor().setValue(Coord(30, 30, 30), 9);
  const auto source = open({someFloats(), heat});
  ASSERT_EQ(source->info().channels.size(), 2u);
  EXPECT_EQ(source->info().channels[0].name, "density");
  EXPECT_EQ(source->info().channels[1].name, "heat");
  EXPECT_EQ(source->info().dims, glm::ivec3(71, 31, 51));
  heat->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  EXPECT_THAT(refusalOf({someFloats(), heat}),
              HasSubstr("holds 2 grids that are not one volume; choose one:\n  --dataset 1: density of float, 942 "
                        "active voxels\n  --dataset 2: heat of float, 1 active voxels"));
  ImportOptions options;
  options.dataset = "2";
  const auto chosen = open({someFloats(), heat}, options);
  EXPECT_EQ(chosen->info().dims, glm::ivec3(1));
  EXPECT_THAT(chosen->info().notes, Contains(HasSubstr("of 2 grids it is 'heat'")));
  options.dataset = "cold";
  EXPECT_THAT(refusalOf({someFloats(), heat}, options), HasSubstr("--dataset cold: there is no such grid; there are"));
}

TEST_F(Vdb, PointsAreCounted) {
  const std::vector<openvdb::Vec3s> places = {{0, 0, 0}, {0.2f, 0, 0}, {5, 6, 7}, {-3, 2, 20}};
  const auto unit = openvdb::math::Transform::createLinearTransform(1);
  auto points =
      openvdb::points::createPointDataGrid<openvdb::points::NullCodec, openvdb::points::PointDataGrid>(places, *unit);
  points->setName("dust");
  const auto source = open({points});
  EXPECT_EQ(source->info().dims, glm::ivec3(9, 7, 21));
  EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("'dust' holds points: values are how many")));
  std::vector<float> counts(9 * 7 * 21);
  counts[3] = 2, counts[8 + 9 * (6 + 7 * 7)] = counts[9 * (2 + 7 * 20)] = 1;
  EXPECT_EQ(readAll(*source), bytesOf(counts));
  EXPECT_THAT(open({points, someFloats()})->info().notes, Contains(HasSubstr("ptdataidx32 is passed over: it holds")));
}

TEST_F(Vdb, WhatIsNoVolumeIsRefusedByName) {
  auto frustum = someFloats();
  frustum->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0), openvdb::Vec3d(100)), 0.5, 10));
  EXPECT_THAT(refusalOf({frustum}), HasSubstr("its transform is a frustum"));
  EXPECT_THAT(refusalOf({named<openvdb::FloatGrid>("none", 0)}), HasSubstr("no voxel of it is active"));
  auto far = someFloats();
  far->getAccessor().setValue(Coord(70000, 0, 0), 1);
  EXPECT_THAT(refusalOf({far}), HasSubstr("box of active voxels: 70041 is outside 1..65536"));
  ImportOptions options;
  options.memory_bytes = 1 << 16;
  EXPECT_THAT(refusalOf({someFloats()}, options), HasSubstr("of memory"));
}

TEST_F(Vdb, MirroredMapsStayMirrored) {
  auto grid = someFloats();
  grid->setTransform(openvdb::math::Transform::Ptr(new openvdb::math::Transform(
      openvdb::math::MapBase::Ptr(new openvdb::math::ScaleMap(openvdb::Vec3d(-1, 1, 1))))));
  const auto source = open({grid});
  EXPECT_LT(glm::determinant(source->info().world_from_index), 0);
  expectSame(*source, *grid, same);
}

// What NanoVDB makes of grids reads as they do.
TEST_F(Vdb, NanoVdbOfAGridIsTheSame) {
#ifdef BLOCKWALK_NANOVDB
  const auto expectAlike = [&](auto grid, const auto& nano) {
    const auto path = scratch_.path("a.nvdb");
    std::filesystem::remove(path);
    nanovdb::io::writeGrid(path.string(), nano);
    const auto theirs = openSource({path}, {});
    const auto ours = open({grid});
    EXPECT_EQ(theirs->info().dims, ours->info().dims);
    EXPECT_EQ(theirs->info().world_from_index, ours->info().world_from_index);
    EXPECT_EQ(readAll(*theirs), readAll(*ours));
  };
  auto bools = named<openvdb::BoolGrid>("b", false);
  fillSome(*bools, [](int i) { return i % 3 == 0; });
  expectAlike(bools, nanovdb::openToNanoVDB(*bools));
  auto mask = openvdb::MaskGrid::create();
  fillSome(*mask, [](int) { return true; });
  mask->tree().addTile(1, Coord(8, 8, 0), true, true);
  expectAlike(mask, nanovdb::openToNanoVDB(*mask));
  auto floats = someFloats();
  floats->tree().addTile(2, Coord(128, 0, -128), 3.0f, true);
  expectAlike(floats, nanovdb::openToNanoVDB(*floats));
  auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(20, openvdb::Vec3f(1, 2, 3), 0.5f);
  expectAlike(sphere, nanovdb::openToNanoVDB(*sphere));
#else
  GTEST_SKIP() << "built without the headers of NanoVDB";
#endif
}

TEST_F(Vdb, RealFilesAreWhatOpenVdbReads) {
  const auto data = realData();
  if (!data || !std::filesystem::is_directory(*data / "vdb_set")) GTEST_SKIP() << "no data";
  const auto grids = [&](const char* name) {
    openvdb::io::File file((*data / "vdb_set" / name).string());
    file.open(false);
    return *file.getGrids();
  };
  const auto smoke = openSource({*data / "vdb_set" / "smoke.vdb"}, {});
  expectSame(*smoke, *openvdb::gridPtrCast<openvdb::FloatGrid>(grids("smoke.vdb")[0]), same);
  const auto sphere = openSource({*data / "vdb_set" / "sphere_levelset.vdb"}, {});
  const auto surface = openvdb::gridPtrCast<openvdb::FloatGrid>(grids("sphere_levelset.vdb")[0]);
  openvdb::tools::sdfToFogVolume(*surface);
  expectSame(*sphere, *surface, same);
  const auto dust = openvdb::gridPtrCast<openvdb::points::PointDataGrid>(grids("points.vdb")[0]);
  const std::string counted = importAll(*data / "vdb_set" / "points.vdb");
  std::vector<float> counts(counted.size() / sizeof(float));
  std::memcpy(counts.data(), counted.data(), counted.size());
  EXPECT_EQ(std::reduce(counts.begin(), counts.end(), 0.0),
            static_cast<double>(openvdb::points::pointCount(dust->tree())));
  ImportOptions options;
  options.dataset = "density";
  for (const auto& grid : grids("bonsai_small.vdb")) {
    if (grid->getName() != "density") continue;
    const auto bonsai = openSource({*data / "vdb_set" / "bonsai_small.vdb"}, options);
    expectSame(*bonsai, *openvdb::gridPtrCast<openvdb::FloatGrid>(grid), same);
  }
  const auto colored = openSource({*data / "vdb_set" / "bonsai_small.vdb"}, {});
  EXPECT_EQ(colored->info().type, VoxelType::rgba8);
  EXPECT_EQ(colored->info().dims, glm::ivec3(91, 197, 256));
}

}  // namespace
}  // namespace blockwalk::volume_test

#else

namespace blockwalk::volume_test {
namespace {

TEST(Vdb, IsRefusedWithoutOpenVdb) {
  const Scratch scratch;
  const auto path = scratch.write("a.vdb", std::string(" BDV\0\0\0\0", 8) + std::string(100, '\0'));
  EXPECT_THAT(refusal({path}), testing::HasSubstr("built without OpenVDB; install libopenvdb-dev"));
}

TEST(Vdb, IsRead) { GTEST_SKIP() << "built without OpenVDB"; }

}  // namespace
}  // namespace blockwalk::volume_test

#endif
