// SPDX-License-Identifier: Apache-2.0
// OME-Zarr: levels, axes, places, channels, labels, and what lies around images.
#include <glm/glm.hpp>

#include "tests/volume/import/zarr/zarr_writer.h"
#include "volume/build/builder.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

const char* const kGroup2 = R"({"zarr_format":2})";

std::string group3(const std::string& ome) {
  return R"({"zarr_format":3,"node_type":"group","attributes":{"ome":)" + ome + "}}";
}

void writeImage2(const Scratch& scratch, const std::string& name, const std::string& attributes) {
  scratch.write(name + "/.zgroup", kGroup2);
  scratch.write(name + "/.zattrs", attributes);
}

ZarrWriter counting(Sizes shape, Sizes chunks) {
  ZarrWriter writer{.shape = std::move(shape), .chunks = std::move(chunks)};
  for (std::size_t i = 0; i < cells(writer.shape); ++i) writer.samples += static_cast<char>(i % 251);
  return writer;
}

ImportOptions atLevel(int level) {
  ImportOptions options;
  options.level = level;
  return options;
}

ImportOptions atTime(int time) {
  ImportOptions options;
  options.time = time;
  return options;
}

const std::string kLevels =
    R"("datasets":[{"path":"0","coordinateTransformations":[{"type":"scale","scale":[1,1,2000,0.5,0.25]},)"
    R"({"type":"translation","translation":[0,0,30000,20,10]}]},)"
    R"({"path":"1","coordinateTransformations":[{"type":"scale","scale":[1,1,4000,1,0.5]},)"
    R"({"type":"translation","translation":[0,0,31000,20.25,10.125]}]}],)"
    R"("coordinateTransformations":[{"type":"scale","scale":[7,1,1,2,2]}])";
const std::string kAxes =
    R"("axes":[{"name":"t","type":"time","unit":"second"},{"name":"c","type":"channel"},)"
    R"({"name":"z","type":"space","unit":"nanometer"},{"name":"y","type":"space","unit":"micrometer"},)"
    R"({"name":"x","type":"space","unit":"micrometer"}],)";
const std::string kOmero =
    R"("omero":{"channels":[{"label":"DAPI","color":"0000FF","window":{"start":10,"end":200,"min":0,"max":255}},)"
    R"({"label":"GFP","color":"00ff00","window":{"start":0.5,"end":99}}]})";

// Two steps, two channels, two levels.
std::filesystem::path twoChannels(const Scratch& scratch) {
  writeImage2(scratch, "i.zarr", "{\"multiscales\":[{" + kAxes + kLevels + "}]," + kOmero + "}");
  counting({2, 2, 3, 4, 5}, {1, 2, 2, 4, 3}).version2(scratch, "i.zarr/0", '/');
  counting({2, 2, 2, 2, 3}, {1, 1, 2, 2, 3}).version2(scratch, "i.zarr/1", '/');
  return scratch.path("i.zarr");
}

TEST(OmeZarr, HasPlaceUnitAndChannels) {
  const Scratch scratch;
  const auto source = openSource({twoChannels(scratch)}, {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.name, "i.zarr");
  EXPECT_EQ(info.format, "zarr");
  EXPECT_EQ(info.dims, glm::ivec3(5, 4, 3));
  EXPECT_EQ(info.length_unit, "um");
  EXPECT_LT(glm::distance(worldOf(info, glm::dvec3(0.5)), glm::dvec3(20, 40, 30)), 1e-9);
  EXPECT_LT(glm::distance(worldOf(info, glm::dvec3(1.5, 2.5, 1.5)), glm::dvec3(20.5, 42, 32)), 1e-9);
  ASSERT_EQ(info.channels.size(), 2u);
  EXPECT_EQ(info.channels[0].name, "DAPI");
  EXPECT_EQ(info.channels[1].name, "GFP");
  EXPECT_EQ(info.channels[0].color, (std::array<std::uint8_t, 3>{0, 0, 255}));
  EXPECT_EQ(info.channels[1].window, (std::array<double, 2>{0.5, 99}));
  EXPECT_THAT(info.notes, testing::Contains(HasSubstr("of the 2 steps in time it is number 0")));
  EXPECT_EQ(readAll(*source), counting({2, 2, 3, 4, 5}, {}).samples.substr(0, 120));
  const VolumeInfo built = buildVolume(*source, scratch.path("i.bwv"), {}).info;
  EXPECT_EQ(built.channels[0].window, (std::array<double, 2>{10, 200}));
  EXPECT_EQ(built.channels[1].color, (Color{0, 255, 0}));
  EXPECT_EQ(built.metadata.length_unit, "um");
}

TEST(OmeZarr, LevelAndTimeAreChosen) {
  const Scratch scratch;
  const auto path = twoChannels(scratch);
  const auto second = openSource({path}, atTime(1));
  EXPECT_EQ(readAll(*second), counting({2, 2, 3, 4, 5}, {}).samples.substr(120));
  const auto coarse = openSource({path}, atLevel(1));
  EXPECT_EQ(coarse->info().dims, glm::ivec3(3, 2, 2));
  EXPECT_EQ(readAll(*coarse), counting({2, 2, 2, 2, 3}, {}).samples.substr(0, 24));
  // Both levels begin at the same place.
  EXPECT_LT(glm::distance(worldOf(coarse->info(), glm::dvec3(0)), worldOf(second->info(), glm::dvec3(0))), 1e-9);
  // By its own folder too.
  const SourceInfo by_folder = openSource({path / "1"}, {})->info();
  EXPECT_EQ(by_folder.world_from_index, coarse->info().world_from_index);
  EXPECT_EQ(by_folder.channels[0].name, "DAPI");
  EXPECT_THAT(refusal({path}, atLevel(2)), HasSubstr("level 2 is asked for, must be 0..1"));
  EXPECT_THAT(refusal({path}, atTime(2)), HasSubstr("time 2 is asked for, must be 0..1"));
}

TEST(OmeZarr, AxesComeInAnyOrder) {
  const Scratch scratch;
  writeImage2(scratch, "a",
              R"({"multiscales":[{"axes":[{"name":"x","type":"space"},{"name":"z","type":"space"},)"
              R"({"name":"y","type":"space"}],"datasets":[{"path":"s/0","coordinateTransformations":)"
              R"([{"type":"scale","scale":[2,3,4]}]}]}]})");
  const ZarrWriter writer = counting({4, 3, 5}, {2, 2, 2});
  writer.version2(scratch, "a/s/0");
  const auto source = openSource({scratch.path("a")}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(4, 5, 3));
  EXPECT_EQ(worldOf(source->info(), {1, 1, 1}), glm::dvec3(2, 4, 3));
  EXPECT_EQ(worldOf(source->info(), {0, 0, 0}), glm::dvec3(0));  // no place is said
  std::string wanted;
  for (std::size_t z = 0; z < 3; ++z) {
    for (std::size_t y = 0; y < 5; ++y) {
      for (std::size_t x = 0; x < 4; ++x) wanted += writer.samples[(x * 3 + z) * 5 + y];
    }
  }
  EXPECT_EQ(readAll(*source), wanted);
  EXPECT_THAT(source->info().notes, IsEmpty());
}

TEST(OmeZarr, AnatomyAndAffineMapsAreKept) {
  const Scratch scratch;
  const std::string axis = R"({{"name":"{}","type":"space","unit":"millimeter","orientation":)"
                           R"({{"type":"anatomical","value":"{}"}}}})";
  scratch.write("a/zarr.json",
                group3(R"({"version":"0.6","multiscales":[{"coordinateSystems":[{"name":"w","axes":[)" +
                       fmt::format(fmt::runtime(axis), "z", "inferior-to-superior") + "," +
                       fmt::format(fmt::runtime(axis), "y", "anterior-to-posterior") + "," +
                       fmt::format(fmt::runtime(axis), "x", "right-to-left") +
                       R"(]}],"datasets":[{"path":"0","coordinateTransformations":[{"type":"sequence","output":"w",)"
                       R"("transformations":[{"type":"scale","scale":[3,2,1]},{"type":"affine","affine":)"
                       R"([[1,0,0,30],[0,0,-1,20],[0,1,0,10]]}]}]}]}]})"));
  ZarrWriter writer = counting({2, 2, 2}, {2, 2, 2});
  writer.dtype = "uint8";
  writer.version3(scratch, "a/0");
  const SourceInfo info = openSource({scratch.path("a")}, {})->info();
  EXPECT_EQ(info.space, "left-posterior-superior");
  EXPECT_EQ(info.length_unit, "mm");
  EXPECT_EQ(worldOf(info, glm::dvec3(0.5)), glm::dvec3(10, 20, 30));
  EXPECT_EQ(worldOf(info, glm::dvec3(1.5, 0.5, 0.5)), glm::dvec3(10, 19, 30));
  EXPECT_EQ(worldOf(info, glm::dvec3(0.5, 1.5, 1.5)), glm::dvec3(12, 20, 33));
}

TEST(OmeZarr, LabelsHaveNamesAndColours) {
  const Scratch scratch;
  const auto path = twoChannels(scratch);
  writeImage2(scratch, "i.zarr/labels", R"({"labels":["cells"]})");
  writeImage2(scratch, "i.zarr/labels/cells",
              R"({"multiscales":[{"axes":["z","y","x"],"datasets":[{"path":"0"}]}],"image-label":{"colors":)"
              R"([{"label-value":2,"rgba":[9,8,7,255]},{"label-value":1,"rgba":[1,2,3,255]}],"properties":)"
              R"([{"label-value":2,"area":5,"name":"nucleus"}]}})");
  counting({2, 3, 3}, {2, 3, 3}).version2(scratch, "i.zarr/labels/cells/0");
  EXPECT_THAT(openSource({path}, {})->info().notes,
              testing::Contains(HasSubstr("labels lie beside it, which labels/NAME opens: cells")));
  for (const char* name : {"labels", "labels/cells"}) {
    const auto source = openSource({path / name}, {});
    const SourceChannel& channel = source->info().channels[0];
    EXPECT_TRUE(channel.is_labels);
    ASSERT_EQ(channel.labels.size(), 2u);
    EXPECT_EQ(channel.labels[0].value, 1);
    EXPECT_EQ(channel.labels[0].color, (Color{1, 2, 3}));
    EXPECT_EQ(channel.labels[1].name, "nucleus");
    const BuildReport report = buildVolume(*source, scratch.path("l.bwv"), {.values = ValuesRule::guess});
    EXPECT_EQ(report.info.channels[0].values, ChannelValues::labels);
    EXPECT_EQ(report.info.channels[0].labels.size(), 2u);
  }
}

TEST(OmeZarr, PlatesAndListsOfImagesOpenTheFirstAndSaySo) {
  const Scratch scratch;
  const std::string image = R"({"multiscales":[{"axes":["y","x"],"datasets":[{"path":"0"}]}]})";
  writeImage2(scratch, "p", R"({"plate":{"wells":[{"path":"A/1"},{"path":"B/2"}]}})");
  writeImage2(scratch, "p/A/1", R"({"well":{"images":[{"path":"0"}]}})");
  writeImage2(scratch, "p/A/1/0", image);
  counting({3, 4}, {2, 2}).version2(scratch, "p/A/1/0/0");
  const auto plate = openSource({scratch.path("p")}, {});
  EXPECT_EQ(plate->info().dims, glm::ivec3(4, 3, 1));
  EXPECT_THAT(
      plate->info().notes,
      testing::Contains(HasSubstr("of the 2 wells it is A/1; name the folder of another to import that: A/1, B/2")));
  writeImage2(scratch, "b", R"({"bioformats2raw.layout":3})");
  for (const char* number : {"0", "1"}) {
    writeImage2(scratch, std::string("b/") + number, image);
    counting({3, 4}, {2, 2}).version2(scratch, std::string("b/") + number + "/0");
  }
  EXPECT_THAT(openSource({scratch.path("b")}, {})->info().notes,
              testing::Contains(HasSubstr("of the 2 images it is 0")));
  writeImage2(scratch, "g", "{}");
  counting({3, 4}, {2, 2}).version2(scratch, "g/density");
  EXPECT_THAT(refusal({scratch.path("g")}), HasSubstr("is a group without an image; it holds density"));
}

TEST(OmeZarr, PlainArraysSayHowTheyAreRead) {
  const Scratch scratch;
  const auto path = counting({2, 3, 4}, {2, 3, 4}).version2(scratch, "a");
  const auto source = openSource({path}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(4, 3, 2));
  EXPECT_THAT(source->info().notes, testing::Contains(HasSubstr("the axes are not named: they are taken for z, y, x")));
  // As Python writes what is no number, outside of texts and in them.
  scratch.write("a/.zattrs",
                R"({"_FillValue":NaN,"most":[-Infinity,Infinity],"a \"NaN":"NaN","_ARRAY_DIMENSIONS":["x","y","z"]})");
  const auto named = openSource({path / ".zarray"}, {});
  EXPECT_EQ(named->info().dims, glm::ivec3(2, 3, 4));
  EXPECT_THAT(named->info().notes, IsEmpty());
}

TEST(OmeZarr, MoreChannelsThanAVolumeHasAreToldOff) {
  const Scratch scratch;
  writeImage2(scratch, "a", R"({"multiscales":[{"axes":["c","y","x"],"datasets":[{"path":"0"}]}]})");
  const ZarrWriter writer = counting({6, 3, 4}, {6, 2, 4});
  writer.version2(scratch, "a/0");
  const auto source = openSource({scratch.path("a")}, {});
  EXPECT_EQ(source->info().channels.size(), 4u);
  EXPECT_THAT(source->info().notes, testing::Contains(HasSubstr("of 6 channels it has the first 4")));
  EXPECT_EQ(readAll(*source), writer.samples.substr(0, 48));
}

TEST(OmeZarr, WhatLeadsOutOrDoesNotFitIsRefused) {
  const Scratch scratch;
  const auto refusalOf = [&](const std::string& multiscale) {
    writeImage2(scratch, "a", "{\"multiscales\":[{" + multiscale + "}]}");
    counting({2, 3, 4}, {2, 3, 4}).version2(scratch, "a/0");
    return refusal({scratch.path("a")});
  };
  EXPECT_THAT(refusalOf(R"("axes":["z","y","x"],"datasets":[{"path":"../a/0"}])"),
              HasSubstr("must stay inside the folder"));
  EXPECT_THAT(refusalOf(R"("axes":["z","y","x"],"datasets":[])"),
              HasSubstr("multiscales[0].datasets is []: must not be empty"));
  EXPECT_THAT(refusalOf(R"("axes":["y","x"],"datasets":[{"path":"0"}])"),
              HasSubstr("shape has 3 axes, the image's metadata say 2"));
  EXPECT_THAT(refusalOf(R"("axes":["z","x","x"],"datasets":[{"path":"0"}])"), HasSubstr("'x' and 'x' are both x"));
  EXPECT_THAT(refusalOf(R"("axes":["z","y","x"],"datasets":[{"path":"0","coordinateTransformations":)"
                        R"([{"type":"scale","scale":[1,0,1]}]}])"),
              HasSubstr("coordinateTransformations: the step along axis 1 has length 0"));
  EXPECT_THAT(refusalOf(R"("axes":["z","y","x"],"datasets":[{"path":"0","coordinateTransformations":)"
                        R"([{"type":"scale","scale":[1,1]}]}])"),
              HasSubstr("scale is [1,1]: must have 3 numbers, one an axis"));
  EXPECT_THAT(refusalOf(R"("axes":["z","y","x"],"datasets":[{"path":"7"}])"), HasSubstr("'7' is no array"));
}

TEST(OmeZarr, RealImagesOpen) {
  const auto data = realData();
  if (!data || !std::filesystem::is_directory(*data / "ome_zarr")) GTEST_SKIP() << "no data";
  const auto head = openSource({*data / "ome_zarr/mni152.ome.zarr"}, atLevel(2));
  EXPECT_EQ(head->info().dims, glm::ivec3(51, 64, 53));
  EXPECT_LT(glm::distance(worldOf(head->info(), glm::dvec3(0.5)),
                          glm::dvec3(-74.65634042024612, -109.65634042024612, -70.65634042024612)),
            1e-9);
  const std::string voxels = readAll(*head);
  std::vector<float> values(voxels.size() / 4);
  std::memcpy(values.data(), voxels.data(), voxels.size());
  EXPECT_FLOAT_EQ(*std::ranges::max_element(values), 84.63332f);
  for (const char* name : {"mni152_axial.ome.zarr", "neuroglancer/simple_0.4", "neuroglancer/simple_0.5",
                           "neuroglancer/all_0.6/simple/anisotropic_rotation.zarr"}) {
    const auto source = openSource({*data / "ome_zarr" / name}, {});
    EXPECT_GT(readAll(*source).size(), 0u) << name;
  }
  EXPECT_THAT(openSource({*data / "ome_zarr/mni152.ome.zarr"}, {})->info().notes,
              testing::Contains(HasSubstr("none of the chunks")));
}

}  // namespace
}  // namespace blockwalk::volume_test
