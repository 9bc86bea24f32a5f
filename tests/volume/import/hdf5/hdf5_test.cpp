// SPDX-License-Identifier: Apache-2.0
// Datasets by themselves: types, layouts, indices, chunks that are not there, axes, what is refused.
#include <glm/glm.hpp>
#include <thread>

#include "tests/volume/import/import_scratch.h"

#ifdef BLOCKWALK_HDF5
#include "tests/volume/import/hdf5/hdf5_writer.h"

namespace blockwalk::volume_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const Extent kHdf5Shape = {5, 6, 7};  // z, y, x

TEST(Hdf5, ReadsEveryTypeInBothByteOrders) {
  const Scratch scratch;
  const std::vector<std::pair<hid_t, hid_t>> types = {
      {H5T_STD_U8LE, H5T_STD_U8BE},     {H5T_STD_I8LE, H5T_STD_I8BE},   {H5T_STD_U16LE, H5T_STD_U16BE},
      {H5T_STD_I16LE, H5T_STD_I16BE},   {H5T_STD_U32LE, H5T_STD_U32BE}, {H5T_STD_I32LE, H5T_STD_I32BE},
      {H5T_STD_U64LE, H5T_STD_U64BE},   {H5T_STD_I64LE, H5T_STD_I64BE}, {H5T_IEEE_F32LE, H5T_IEEE_F32BE},
      {H5T_IEEE_F64LE, H5T_IEEE_F64BE}, {H5T_STD_B8LE, H5T_STD_B16BE}};
  for (const auto& [little, big] : types) {
    for (const hid_t type : {little, big}) {
      const bool is_signed =
          H5Tget_class(type) == H5T_FLOAT || (H5Tget_class(type) == H5T_INTEGER && H5Tget_sign(type) == H5T_SGN_2);
      std::vector<int> values = countedUp(sampleCount(kHdf5Shape));
      for (int& value : values) value = value % 120 - (is_signed ? 60 : 0);
      const bool is_bits = H5Tget_class(type) == H5T_BITFIELD;
      for (const Extent& chunk : {Extent{}, Extent{2, 4, 3}}) {
        Hdf5Writer writer(scratch.path("a.h5"));
        if (is_bits) {
          // Bits are turned into no number: they are written as they are.
          std::vector<std::uint16_t> bits(values.begin(), values.end());
          writer.dataset("v", kHdf5Shape, bits, {.type = type, .memory = H5T_NATIVE_B16, .chunk = chunk});
        } else {
          writer.dataset("v", kHdf5Shape, values, {.type = type, .chunk = chunk});
        }
        const auto source = openSource({writer.close()}, {});
        EXPECT_EQ(source->info().dims, glm::ivec3(7, 6, 5));
        EXPECT_EQ(dataValues(*source), doubles(values)) << H5Tget_size(type) << ' ' << chunk.size();
      }
    }
  }
}

TEST(Hdf5, ReadsHalvesAndTruths) {
  const Scratch scratch;
  for (const bool is_big : {false, true}) {
    const hid_t half = H5Tcopy(is_big ? H5T_IEEE_F32BE : H5T_IEEE_F32LE);
    H5Tset_fields(half, 15, 10, 5, 0, 10);
    H5Tset_size(half, 2);
    H5Tset_ebias(half, 15);
    Hdf5Writer writer(scratch.path("half.h5"));
    writer.dataset<float>("v", {1, 2, 2}, {0.5f, -2, 1024, 0}, {.type = half, .memory = H5T_NATIVE_FLOAT});
    EXPECT_THAT(dataValues(*openSource({writer.close()}, {})), ElementsAre(0.5, -2, 1024, 0));
    H5Tclose(half);
  }
  const hid_t truth = H5Tenum_create(H5T_NATIVE_INT8);
  for (const auto& [name, value] : {std::pair{"FALSE", std::int8_t{0}}, std::pair{"TRUE", std::int8_t{1}}}) {
    H5Tenum_insert(truth, name, &value);
  }
  Hdf5Writer writer(scratch.path("truth.h5"));
  writer.dataset<std::int8_t>("v", {1, 2, 2}, {0, 1, 1, 0}, {.type = truth, .memory = truth});
  EXPECT_THAT(dataValues(*openSource({writer.close()}, {})), ElementsAre(0, 1, 1, 0));
  H5Tclose(truth);
}

TEST(Hdf5, ReadsEveryLayoutAndIndex) {
  const Scratch scratch;
  const std::vector<int> values = countedUp(sampleCount(kHdf5Shape));
  const hsize_t no_end = H5S_UNLIMITED;
  const std::vector<DatasetKind> kinds = {
      {.properties = [](hid_t p) { H5Pset_layout(p, H5D_COMPACT); }},
      {},
      {.chunk = {5, 6, 7}},                               // of the newest format: a single chunk
      {.chunk = {2, 3, 4}},                               // an array of chunks
      {.chunk = {2, 3, 4}, .most = {no_end, 6, 7}},       // one that grows
      {.chunk = {2, 3, 4}, .most = {no_end, no_end, 7}},  // a tree
      {.chunk = {2, 3, 4}, .properties = [](hid_t p) { H5Pset_alloc_time(p, H5D_ALLOC_TIME_EARLY); }},
      {.chunk = {2, 3, 4}, .properties = [](hid_t p) {
         H5Pset_deflate(p, 4);
         H5Pset_chunk_opts(p, H5D_CHUNK_DONT_FILTER_PARTIAL_CHUNKS);
       }}};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    for (const bool latest : {false, true}) {
      if (!latest && i == kinds.size() - 1) continue;  // that option is new
      for (const hsize_t user_block : {0, 512, 2048}) {
        Hdf5Writer writer(scratch.path("a.h5"), latest, user_block);
        writer.dataset("g/v", kHdf5Shape, values, kinds[i]);
        EXPECT_EQ(dataValues(*openSource({writer.close()}, {})), doubles(values)) << i << latest << user_block;
      }
    }
  }
}

TEST(Hdf5, ReadsOnSeveralThreads) {
  const Scratch scratch;
  Hdf5Writer writer(scratch.path("a.h5"));
  const Extent shape = {24, 25, 26};
  writer.dataset("v", shape, countedUp(sampleCount(shape)),
                 {.type = H5T_STD_U16BE, .chunk = {5, 7, 11}, .properties = [](hid_t p) { H5Pset_deflate(p, 1); }});
  const auto source = openSource({writer.close()}, {});
  const std::string whole = readAll(*source);
  std::vector<std::string> found(4);
  {
    std::vector<std::jthread> threads;
    for (std::string& all : found) {
      threads.emplace_back([&all, other = std::shared_ptr<Source>(source->another())] { all = readAll(*other, 7); });
    }
  }
  for (const std::string& all : found) EXPECT_EQ(all, whole);
}

TEST(Hdf5, ChunksThatAreNotThereAreBlank) {
  const Scratch scratch;
  for (const bool latest : {false, true}) {
    Hdf5Writer writer(scratch.path("a.h5"), latest);
    const Extent shape = {16, 16, 64};
    DatasetKind kind{.type = H5T_STD_I16BE, .chunk = {8, 8, 16}};
    kind.properties = [](hid_t p) {
      const int fill = 7;
      H5Pset_fill_value(p, H5T_NATIVE_INT, &fill);
      H5Pset_deflate(p, 1);
    };
    writer.create("v", shape, kind, [](hid_t dataset) {
      const hid_t space = H5Dget_space(dataset);
      const Extent first = {8, 0, 32};
      const Extent count = {8, 8, 16};
      H5Sselect_hyperslab(space, H5S_SELECT_SET, first.data(), nullptr, count.data(), nullptr);
      const hid_t memory = H5Screate_simple(3, count.data(), nullptr);
      const std::vector<int> values(sampleCount(count), -3);
      H5Dwrite(dataset, H5T_NATIVE_INT, memory, space, H5P_DEFAULT, values.data());
      H5Sclose(memory);
      H5Sclose(space);
    });
    const auto source = openSource({writer.close()}, {});
    const SourceInfo& info = source->info();
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(info.blank.data()), info.blank.size()),
              bytesOf<std::uint16_t>({7 + 32768}));
    std::vector<VoxelRun> runs;
    source->findRuns({.begin = {0, 0, 0}, .end = info.dims}, runs);
    EXPECT_THAT(runs, ElementsAre(VoxelRun{32, 48}));
    source->findRuns({.begin = {0, 0, 0}, .end = {64, 16, 8}}, runs);
    EXPECT_THAT(runs, IsEmpty());
    const std::vector<double> values = dataValues(*source);
    EXPECT_EQ(values[(8 * 16 + 7) * 64 + 40], -3);
    EXPECT_EQ(values[(8 * 16 + 8) * 64 + 40], 7);
    EXPECT_EQ(std::ranges::count(values, -3), 8 * 8 * 16);
  }
}

TEST(Hdf5, TellsThatNothingIsThere) {
  const Scratch scratch;
  for (const Extent& chunk : {Extent{}, Extent{2, 2, 2}}) {
    Hdf5Writer writer(scratch.path("a.h5"));
    writer.dataset<int>("v", kHdf5Shape, {}, {.chunk = chunk});
    const auto source = openSource({writer.close()}, {});
    EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("all of it is the fill value")));
    EXPECT_FALSE(source->info().blank.empty());
    EXPECT_EQ(dataValues(*source), std::vector<double>(sampleCount(kHdf5Shape), 0));
  }
}

TEST(Hdf5, OneOfSeveralIsChosen) {
  const Scratch scratch;
  Hdf5Writer writer(scratch.path("a.h5"));
  writer.dataset("raw/data", kHdf5Shape, std::vector<int>(sampleCount(kHdf5Shape), 1));
  writer.dataset("seg", kHdf5Shape, std::vector<int>(sampleCount(kHdf5Shape), 2), {.type = H5T_STD_U32LE});
  writer.dataset("table", {9}, countedUp(9));
  H5Lcreate_soft("/raw/data", writer.file(), "alias", H5P_DEFAULT, H5P_DEFAULT);
  const auto path = writer.close();
  EXPECT_EQ(refusal({path}),
            "a.h5: holds several datasets; choose one with --dataset PATH: 'raw/data' (5 x 6 x 7 u8), 'seg' (5 x 6 x 7 "
            "u32)");
  for (const char* name : {"raw/data", "/raw/data", "alias"}) {
    EXPECT_EQ(dataValues(*openSource({path}, choosing({.dataset = name}))),
              std::vector<double>(sampleCount(kHdf5Shape), 1));
  }
  EXPECT_EQ(dataValues(*openSource({path}, choosing({.dataset = "seg"}))),
            std::vector<double>(sampleCount(kHdf5Shape), 2));
  EXPECT_THAT(refusal({path}, choosing({.dataset = "nothing"})),
              HasSubstr("'nothing' is not there; there is 'raw/data'"));
  EXPECT_THAT(refusal({path}, choosing({.dataset = "raw"})), HasSubstr("'raw' is a group"));
  EXPECT_THAT(refusal({path}, choosing({.dataset = "table"})),
              HasSubstr("'table': is 9 u8; a volume has 2 axes and more"));
  EXPECT_THAT(refusal({path}, choosing({.level = 1, .dataset = "seg"})), HasSubstr("level 1 is asked for"));
  EXPECT_THAT(refusal({path}, choosing({.time = 1, .dataset = "seg"})), HasSubstr("time 1 is asked for"));
}

TEST(Hdf5, FourAxesAreChannelsOrFrames) {
  const Scratch scratch;
  const auto write = [&](const Extent& shape) {
    Hdf5Writer writer(scratch.path("a.h5"));
    Extent chunk(shape.size(), 2);
    for (std::size_t i = 0; i < chunk.size(); ++i) chunk[i] = std::min(chunk[i], shape[i]);
    writer.dataset("v", shape, countedUp(sampleCount(shape)), {.type = H5T_STD_U16LE, .chunk = chunk});
    return writer.close();
  };
  const auto last = openSource({write({2, 3, 5, 3})}, {});
  EXPECT_EQ(last->info().dims, glm::ivec3(5, 3, 2));
  ASSERT_EQ(last->info().channels.size(), 3u);
  const std::vector<double> values = dataValues(*last);
  for (std::size_t i = 0; i < 30; ++i) {
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(values[30 * c + i], static_cast<double>(3 * i + c));
  }
  const auto first = openSource({write({2, 3, 5, 7})}, {});
  EXPECT_EQ(first->info().channels.size(), 2u);
  EXPECT_EQ(first->info().dims, glm::ivec3(7, 5, 3));
  EXPECT_EQ(dataValues(*first), doubles(countedUp(210)));
  const auto frames = openSource({write({6, 3, 5, 7})}, choosing({.frame = 4}));
  EXPECT_EQ(frames->info().channels.size(), 1u);
  EXPECT_EQ(dataValues(*frames).front(), 4 * 105);
  EXPECT_THAT(openSource({write({6, 3, 5, 7})}, {})->info().notes, ElementsAre(HasSubstr("--frame chooses another")));
  EXPECT_EQ(openSource({write({1, 1, 3, 5, 7})}, {})->info().dims, glm::ivec3(7, 5, 3));
  EXPECT_EQ(openSource({write({3, 5, 7, 1})}, {})->info().dims, glm::ivec3(7, 5, 3));
  EXPECT_EQ(openSource({write({5, 7})}, {})->info().dims, glm::ivec3(7, 5, 1));
  EXPECT_THAT(refusal({write({5, 6, 3, 5, 7})}), HasSubstr("has 5 axes that are longer than 1 and not named"));
}

TEST(Hdf5, AxesHaveNamesAndSizes) {
  const Scratch scratch;
  {
    Hdf5Writer writer(scratch.path("ilastik.h5"));
    writer.dataset("volume/data", {2, 3, 4, 5, 2}, countedUp(240), {.type = H5T_STD_U8LE, .chunk = {1, 2, 3, 4, 1}});
    writer.text("volume/data", "axistags",
                R"({"axes":[{"key":"t","typeFlags":8,"resolution":0},{"key":"x","resolution":0.5},{"key":"y"},)"
                R"({"key":"z","resolution":2},{"key":"c","typeFlags":1}]})");
    const auto source = openSource({writer.close()}, choosing({.time = 1}));
    EXPECT_EQ(source->info().dims, glm::ivec3(3, 4, 5));
    EXPECT_EQ(source->info().channels.size(), 2u);
    EXPECT_EQ(glm::length(glm::dvec3(source->info().world_from_index[2])), 2);
    const std::vector<double> values = dataValues(*source);
    EXPECT_EQ(values[0], 120);
    EXPECT_EQ(values[1], 120 + 4 * 5 * 2);  // x lies farthest apart
    EXPECT_EQ(values[60], 121);
  }
  Hdf5Writer writer(scratch.path("fiji.h5"));
  writer.dataset("t0/channel0", kHdf5Shape, countedUp(sampleCount(kHdf5Shape)));
  writer.numbers("t0/channel0", "element_size_um", {3, 2, 0.5});
  const auto source = openSource({writer.close()}, {});
  EXPECT_EQ(worldOf(source->info(), {1, 1, 1}), glm::dvec3(0.5, 2, 3));
  EXPECT_EQ(worldOf(source->info(), {0, 0, 0}), glm::dvec3(0));
  EXPECT_EQ(source->info().length_unit, "um");
}

// An axis of some other name is what is left of z.
TEST(Hdf5, AnAxisOfPressureIsDepth) {
  const Scratch scratch;
  Hdf5Writer writer(scratch.path("a.h5"));
  writer.dataset("wind", {6, 5, 4}, countedUp(120), {.type = H5T_STD_I16LE});
  writer.texts("wind", "DIMENSION_LABELS", {"plev", "lat", "lon"});
  const auto source = openSource({writer.close()}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(4, 5, 6));
  EXPECT_THAT(source->info().notes, testing::Contains(testing::HasSubstr("axis 'plev' is taken for z")));
}

TEST(Hdf5, ScalesOfNetcdfAreKept) {
  const Scratch scratch;
  Hdf5Writer writer(scratch.path("a.nc"));
  const std::vector<int> values = countedUp(24);
  writer.dataset("temperature", {2, 3, 4}, values, {.type = H5T_STD_I16LE});
  writer.dataset<double>("depth", {2}, {10, 30}, {.type = H5T_IEEE_F64LE, .memory = H5T_NATIVE_DOUBLE});
  writer.dataset<double>("lat", {3}, {0, 1, 2}, {.type = H5T_IEEE_F64LE, .memory = H5T_NATIVE_DOUBLE});
  writer.dataset<double>("lon", {4}, {5, 4, 3, 2}, {.type = H5T_IEEE_F64LE, .memory = H5T_NATIVE_DOUBLE});
  for (const char* name : {"depth", "lat", "lon"}) writer.text(name, "units", "km");
  writer.numbers("temperature", "scale_factor", {0.5});
  writer.numbers("temperature", "add_offset", {100});
  writer.numbers("temperature", "_FillValue", {-8});
  writer.text("temperature", "units", "K");
  const hid_t type = H5Tvlen_create(H5T_STD_REF_OBJ);
  const hsize_t three = 3;
  const hid_t space = H5Screate_simple(1, &three, nullptr);
  const hid_t lists = H5Acreate_by_name(writer.file(), "temperature", "DIMENSION_LIST", type, space, H5P_DEFAULT,
                                        H5P_DEFAULT, H5P_DEFAULT);
  std::array<hobj_ref_t, 3> references{};
  std::array<hvl_t, 3> of_axes{};
  for (std::size_t i = 0; i < 3; ++i) {
    H5Rcreate(&references[i], writer.file(), std::array{"depth", "lat", "lon"}[i], H5R_OBJECT, -1);
    of_axes[i] = {.len = 1, .p = &references[i]};
  }
  H5Awrite(lists, type, of_axes.data());
  H5Aclose(lists);
  H5Sclose(space);
  H5Tclose(type);
  const auto source = openSource({writer.close()}, {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.length_unit, "km");
  EXPECT_EQ(worldOf(info, {0.5, 0.5, 0.5}), glm::dvec3(5, 0, 10));
  EXPECT_EQ(worldOf(info, {1.5, 1.5, 1.5}), glm::dvec3(4, 1, 30));
  EXPECT_EQ(info.channels[0].unit, "K");
  EXPECT_THAT(info.notes, ElementsAre(HasSubstr("96 is where there is no value")));
  std::vector<double> wanted;
  for (const int value : values) wanted.push_back(100 + 0.5 * value);
  EXPECT_EQ(dataValues(*source), wanted);
}

TEST(Hdf5, RefusesByName) {
  const Scratch scratch;
  const auto refused = [&](const DatasetKind& kind) {
    Hdf5Writer writer(scratch.path("a.h5"), true);
    writer.dataset<int>("v", {4, 4, 4}, {}, kind);
    return refusal({writer.close()}, choosing({.dataset = "v"}));
  };
  const hid_t compound = H5Tcreate(H5T_COMPOUND, 8);
  H5Tinsert(compound, "r", 0, H5T_IEEE_F32LE);
  H5Tinsert(compound, "i", 4, H5T_IEEE_F32LE);
  EXPECT_THAT(refused({.type = compound}), HasSubstr("a.h5: 'v': is of type compound"));
  EXPECT_THAT(refused({.type = H5T_C_S1}), HasSubstr("is of type strings"));
  EXPECT_THAT(refused({.type = H5T_STD_REF_OBJ}), HasSubstr("is of type references"));
  const hid_t twelve = H5Tcopy(H5T_STD_U16LE);
  H5Tset_precision(twelve, 12);
  EXPECT_THAT(refused({.type = twelve}), HasSubstr("integers of 12 bits in 2 bytes"));
  EXPECT_THAT(refused({.chunk = {2, 2, 2}, .properties = [](hid_t p) { H5Pset_scaleoffset(p, H5Z_SO_INT, 0); }}),
              HasSubstr("filter scaleoffset cannot be undone"));
  EXPECT_THAT(refused({.properties = [](hid_t p) { H5Pset_external(p, "/etc/hostname", 0, 64); }}),
              HasSubstr("lie in other files, which are not followed"));
  Hdf5Writer writer(scratch.path("v.h5"), true);
  writer.dataset("s", {4, 4, 4}, countedUp(64));
  writer.create("v", {4, 4, 4},
                {.properties =
                     [](hid_t p) {
                       const Extent shape = {4, 4, 4};
                       const hid_t space = H5Screate_simple(3, shape.data(), nullptr);
                       H5Pset_virtual(p, space, "other.h5", "s", space);
                       H5Sclose(space);
                     }},
                [](hid_t /*dataset*/) {});
  H5Lcreate_external("other.h5", "/s", writer.file(), "away", H5P_DEFAULT, H5P_DEFAULT);
  H5Lcreate_soft("/away", writer.file(), "round", H5P_DEFAULT, H5P_DEFAULT);
  const auto path = writer.close();
  EXPECT_THAT(refusal({path}, choosing({.dataset = "v"})), HasSubstr("'v': is a virtual dataset"));
  EXPECT_THAT(refusal({path}, choosing({.dataset = "away"})),
              HasSubstr("'away' is an external link; other files are not followed"));
  EXPECT_THAT(refusal({path}, choosing({.dataset = "round"})), HasSubstr("'round' cannot be opened"));
  EXPECT_EQ(openSource({path}, choosing({.dataset = "s"}))->info().dims, glm::ivec3(4));
  H5Tclose(twelve);
  H5Tclose(compound);
}

TEST(Hdf5, RefusesWhatDoesNotFit) {
  const Scratch scratch;
  ImportOptions options;
  options.memory_bytes = std::uint64_t{4} << 20;
  Hdf5Writer large(scratch.path("a.h5"), true);
  large.dataset<int>("v", {512, 512, 512}, {}, {.chunk = {128, 128, 128}});
  EXPECT_THAT(refusal({large.close()}, options), HasSubstr("a chunk of 128 x 128 x 128 has more than 1048576 bytes"));
  Hdf5Writer many(scratch.path("b.h5"), true);
  many.dataset<int>("v", {512, 512, 512}, {}, {.chunk = {8, 8, 8}});
  EXPECT_THAT(refusal({many.close()}, options), HasSubstr("has more than 16384 chunks of 8 x 8 x 8"));
  Hdf5Writer wide(scratch.path("c.h5"), true);
  wide.dataset<int>("v", {2, 2, 70000}, {}, {.chunk = {1, 1, 1000}});
  EXPECT_THAT(refusal({wide.close()}, options), HasSubstr("70000 is outside 1..65536"));
  Hdf5Writer none(scratch.path("d.h5"));
  none.dataset("line", {4}, countedUp(4));
  EXPECT_THAT(refusal({none.close()}), HasSubstr("holds no dataset of numbers with 2 to 5 axes"));
  EXPECT_THAT(refusal({scratch.write("e.h5", "\x89HDF\r\n\x1a\n" + std::string(100, 'x'))}),
              HasSubstr("e.h5: is no HDF5 file that libhdf5 can open"));
}

}  // namespace
}  // namespace blockwalk::volume_test

#else

namespace blockwalk::volume_test {
namespace {

TEST(Hdf5, IsRefusedWithoutItsLibrary) {
  const Scratch scratch;
  EXPECT_THAT(refusal({scratch.write("a.h5", "\x89HDF\r\n\x1a\n" + std::string(100, 'x'))}),
              testing::HasSubstr("a.h5: is HDF5, which this program was built without: install libhdf5-dev"));
  GTEST_SKIP() << "this build has no HDF5: nothing else of it can be read or written";
}

}  // namespace
}  // namespace blockwalk::volume_test

#endif
