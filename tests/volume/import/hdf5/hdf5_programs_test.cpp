// SPDX-License-Identifier: Apache-2.0
// Files as Imaris, BigDataViewer, ITK and NeXus write them: what is said about place, channels, levels and time.
#include <glm/glm.hpp>

#include "tests/volume/import/import_scratch.h"

#ifdef BLOCKWALK_HDF5
#include "tests/volume/import/hdf5/hdf5_writer.h"

namespace blockwalk::volume_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

void expectNear(glm::dvec3 found, glm::dvec3 wanted) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(found[i], wanted[i], 1e-9) << i;
}

// Two levels, two steps in time; the value of a voxel says which they are and where it lies.
std::filesystem::path writeImaris(const Scratch& scratch, int channels, const std::string& size_z = "5") {
  Hdf5Writer writer(scratch.path("cells.ims"));
  writer.characters("/", "DataSetDirectoryName", "DataSet");
  writer.characters("/", "DataSetInfoDirectoryName", "DataSetInfo");
  for (int level = 0; level < 2; ++level) {
    for (int time = 0; time < 2; ++time) {
      for (int channel = 0; channel < channels; ++channel) {
        const std::string group =
            fmt::format("DataSet/ResolutionLevel {}/TimePoint {}/Channel {}", level, time, channel);
        const Extent filled_up = level == 0 ? Extent{8, 8, 16} : Extent{4, 4, 8};
        std::vector<int> values(sampleCount(filled_up), 100 * level + 10 * time + channel);
        values.back() = 255;  // beyond the image
        writer.dataset(group + "/Data", filled_up, values,
                       {.type = H5T_STD_U8LE, .chunk = {4, 4, 8}, .properties = [](hid_t p) { H5Pset_deflate(p, 2); }});
        writer.characters(group, "ImageSizeX", level == 0 ? "10" : "5");
        writer.characters(group, "ImageSizeY", level == 0 ? "6" : "3");
        writer.characters(group, "ImageSizeZ", level == 0 ? size_z : "3");
      }
    }
  }
  writer.group("DataSetInfo/Image");
  const std::vector<std::string> low = {"-10", "20.5", "0"};
  const std::vector<std::string> high = {"10", "23.5", "15"};
  for (std::size_t i = 0; i < 3; ++i) {
    writer.characters("DataSetInfo/Image", fmt::format("ExtMin{}", i), low[i]);
    writer.characters("DataSetInfo/Image", fmt::format("ExtMax{}", i), high[i]);
  }
  writer.characters("DataSetInfo/Image", "Unit", "um");
  for (int channel = 0; channel < channels; ++channel) {
    const std::string group = fmt::format("DataSetInfo/Channel {}", channel);
    writer.group(group);
    writer.characters(group, "Name", channel == 0 ? "DAPI" : "(name not specified)");
    writer.characters(group, "Color", channel == 0 ? "0.000 0.500 1.000" : "1 1 1");
    writer.characters(group, "ColorRange", "5.000 200.000");
  }
  return writer.close();
}

TEST(Imaris, HasPlaceChannelsLevelsAndTime) {
  const Scratch scratch;
  const auto path = writeImaris(scratch, 2);
  const auto source = openSource({path}, {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.format, "hdf5");
  EXPECT_EQ(info.dims, glm::ivec3(10, 6, 5));
  expectNear(worldOf(info, {0, 0, 0}), {-10, 20.5, 0});
  expectNear(worldOf(info, {10, 6, 5}), {10, 23.5, 15});
  EXPECT_EQ(info.length_unit, "um");
  ASSERT_THAT(info.channels, SizeIs(2));
  EXPECT_EQ(info.channels[0].name, "DAPI");
  EXPECT_EQ(info.channels[1].name, "");
  EXPECT_EQ(info.channels[0].color, (std::array<std::uint8_t, 3>{0, 128, 255}));
  EXPECT_EQ(info.channels[0].window, (std::array{5.0, 200.0}));
  EXPECT_THAT(info.notes, ElementsAre(HasSubstr("of the 2 steps in time it is number 0")));
  const std::vector<double> values = dataValues(*source);
  EXPECT_EQ(std::ranges::count(values, 0), 300);
  EXPECT_EQ(std::ranges::count(values, 1), 300);

  const auto coarse = openSource({path}, choosing({.level = 1, .time = 1, .dataset = "Channel 1"}));
  EXPECT_EQ(coarse->info().dims, glm::ivec3(5, 3, 3));
  expectNear(worldOf(coarse->info(), {5, 3, 3}), {10, 23.5, 15});
  EXPECT_EQ(dataValues(*coarse), std::vector<double>(45, 111));
  EXPECT_EQ(dataValues(*openSource({path}, choosing({.dataset = "DAPI"}))), std::vector<double>(300, 0));
  EXPECT_EQ(
      openSource({path}, choosing({.dataset = "DataSet/ResolutionLevel 0/TimePoint 0/Channel 0/Data"}))->info().dims,
      glm::ivec3(16, 8, 8));
  EXPECT_THAT(refusal({path}, choosing({.level = 2})), HasSubstr("level 2 is asked for, must be 0..1"));
  EXPECT_THAT(refusal({path}, choosing({.time = 2})), HasSubstr("time 2 is asked for, must be 0..1"));
  EXPECT_THAT(refusal({path}, choosing({.dataset = "GFP"})), HasSubstr("none of Channel 0..1"));
}

TEST(Imaris, TellsOfMoreChannelsAndRefusesWrongSizes) {
  const Scratch scratch;
  const auto many = openSource({writeImaris(scratch, 5)}, {});
  EXPECT_THAT(many->info().channels, SizeIs(4));
  EXPECT_THAT(many->info().notes, Contains(HasSubstr("of 5 channels it has the first 4")));
  EXPECT_THAT(refusal({writeImaris(scratch, 1, "9")}), HasSubstr("ImageSizeZ is '9', must be 1..8"));
  EXPECT_THAT(refusal({writeImaris(scratch, 1, "five")}), HasSubstr("ImageSizeZ is 'five'"));
}

void writeBdv(const std::filesystem::path& path, int setups) {
  Hdf5Writer writer(path);
  for (int setup = 0; setup < setups; ++setup) {
    const std::string name = fmt::format("s{:02}", setup);
    writer.dataset<double>(name + "/resolutions", {2, 3}, {1, 1, 1, 2, 2, 1},
                           {.type = H5T_IEEE_F64LE, .memory = H5T_NATIVE_DOUBLE});
    for (int time = 0; time < 2; ++time) {
      for (int level = 0; level < 2; ++level) {
        const Extent shape = level == 0 ? Extent{4, 6, 8} : Extent{4, 3, 4};
        writer.dataset(fmt::format("t{:05}/{}/{}/cells", time, name, level), shape,
                       std::vector<int>(sampleCount(shape), -1000 + 100 * setup + 10 * time + level),
                       {.type = H5T_STD_I16LE, .chunk = {2, 2, 4}});
      }
    }
  }
  writer.close();
}

std::string viewSetup(int id, int channel, int angle) {
  return fmt::format(
      "<ViewSetup><id>{}</id><name>view {}</name><voxelSize><unit>um</unit><size>0.5 0.5 2</size></voxelSize>"
      "<attributes><channel>{}</channel><angle>{}</angle></attributes></ViewSetup>",
      id, id, channel, angle);
}

std::string bdvXml(const std::string& data, const std::string& registrations) {
  return "<?xml version=\"1.0\"?>\n<SpimData version=\"0.2\"><BasePath type=\"relative\">.</BasePath>"
         "<SequenceDescription><ImageLoader format=\"bdv.hdf5\">" +
         data + "</ImageLoader><ViewSetups>" + viewSetup(0, 0, 0) + viewSetup(1, 1, 0) + viewSetup(2, 0, 90) +
         "<Attributes name=\"channel\"><Channel><id>0</id><name>GFP</name><color>0 255 0 255</color></Channel>"
         "<Channel><id>1</id><name>1</name></Channel></Attributes></ViewSetups>"
         "<Timepoints type=\"range\"><first>0</first><last>1</last></Timepoints></SequenceDescription>"
         "<ViewRegistrations>" +
         registrations + "</ViewRegistrations></SpimData>";
}

std::string registration(int time, int setup, const std::vector<std::string>& affines) {
  std::string text = fmt::format("<ViewRegistration timepoint=\"{}\" setup=\"{}\">", time, setup);
  for (const std::string& affine : affines) {
    text += "<ViewTransform type=\"affine\"><affine>" + affine + "</affine></ViewTransform>";
  }
  return text + "</ViewRegistration>";
}

TEST(BigDataViewer, HasPlaceChannelsLevelsAndTime) {
  const Scratch scratch;
  writeBdv(scratch.path("fly.h5"), 3);
  // The calibration goes first; what is above it moves and turns.
  const std::vector<std::string> affines = {"1 0 0 100 0 1 0 0 0 0 1 0", "0 -1 0 0 1 0 0 0 0 0 1 0",
                                            "0.5 0 0 0 0 0.5 0 0 0 0 2 0"};
  std::string registrations;
  for (int time = 0; time < 2; ++time) {
    for (int setup = 0; setup < 2; ++setup) registrations += registration(time, setup, affines);
    registrations += registration(time, 2, {"0.5 0 0 0 0 0.5 0 0 0 0 2 0"});
  }
  const auto xml = scratch.write("fly.xml", bdvXml("<hdf5 type=\"relative\">fly.h5</hdf5>", registrations));
  for (const auto& path : {scratch.path("fly.h5"), xml}) {
    const auto source = openSource({path}, choosing({.time = 1}));
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.dims, glm::ivec3(8, 6, 4));
    EXPECT_EQ(info.length_unit, "um");
    expectNear(worldOf(info, {0.5, 0.5, 0.5}), {100, 0, 0});
    expectNear(worldOf(info, {1.5, 0.5, 0.5}), {100, 0.5, 0});
    expectNear(worldOf(info, {0.5, 1.5, 0.5}), {99.5, 0, 0});
    expectNear(worldOf(info, {0.5, 0.5, 1.5}), {100, 0, 2});
    ASSERT_THAT(info.channels, SizeIs(2));
    EXPECT_EQ(info.channels[0].name, "GFP");
    EXPECT_EQ(info.channels[0].color, (std::array<std::uint8_t, 3>{0, 255, 0}));
    EXPECT_THAT(info.notes, Contains(HasSubstr("of 3 setups it has s00, s01 (angle 0); --dataset sNN chooses others")));
    const std::vector<double> values = dataValues(*source);
    EXPECT_EQ(values.front(), 65536 - 1000 + 10);  // all of it is unsigned
    EXPECT_EQ(values.back(), 65536 - 1000 + 110);
    const auto coarse = openSource({path}, choosing({.level = 1}));
    EXPECT_EQ(coarse->info().dims, glm::ivec3(4, 3, 4));
    expectNear(worldOf(coarse->info(), {0, 0, 0}), worldOf(info, {0, 0, 0}));
    expectNear(worldOf(coarse->info(), {4, 3, 4}), worldOf(info, {8, 6, 4}));
    const auto other = openSource({path}, choosing({.dataset = "s02"}));
    ASSERT_THAT(other->info().channels, SizeIs(1));
    EXPECT_EQ(dataValues(*other).front(), 65536 - 800);
    expectNear(worldOf(other->info(), {0, 0, 0}), {-0.25, -0.25, -1});
  }
  EXPECT_THAT(refusal({xml}, choosing({.dataset = "s07"})), HasSubstr("none of the 3 setups from s00 to s02"));
  EXPECT_THAT(refusal({xml}, choosing({.level = 2})), HasSubstr("level 2 is asked for, must be 0..1"));
}

TEST(BigDataViewer, ReadsWithoutXml) {
  const Scratch scratch;
  writeBdv(scratch.path("a.h5"), 6);
  const auto source = openSource({scratch.path("a.h5")}, {});
  EXPECT_THAT(source->info().channels, SizeIs(4));
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("of 6 setups on one grid it has the first 4")));
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("no XML file of this name lies beside it")));
  EXPECT_THAT(openSource({scratch.path("a.h5")}, choosing({.dataset = "s04"}))->info().channels, SizeIs(2));
}

TEST(BigDataViewer, XmlIsHeldToItsFolder) {
  const Scratch scratch;
  writeBdv(scratch.path("in/a.h5").parent_path().parent_path() / "out.h5", 3);
  const auto write = [&](const std::string& data) { return scratch.write("in/a.xml", bdvXml(data, "")); };
  EXPECT_THAT(refusal({write("<hdf5 type=\"relative\">../out.h5</hdf5>")}),
              HasSubstr("inside the header's own folder"));
  EXPECT_THAT(refusal({write("<hdf5 type=\"absolute\">/etc/passwd</hdf5>")}), HasSubstr("'passwd' cannot be opened"));
  EXPECT_THAT(refusal({scratch.write(
                  "n5.xml",
                  "<SpimData><SequenceDescription><ImageLoader format=\"bdv.n5\"/></SequenceDescription></SpimData>")}),
              HasSubstr("n5.xml: ImageLoader is of 'bdv.n5'"));
  EXPECT_THAT(refusal({scratch.write("cut.xml", "<SpimData><Seq")}), HasSubstr("cut.xml: is no XML of SpimData"));
  std::filesystem::rename(scratch.path("out.h5"), scratch.path("in/a.h5"));
  const auto source = openSource({write("<hdf5 type=\"absolute\">C:\\data\\a.h5</hdf5>")}, {});
  EXPECT_THAT(source->info().notes, Contains(HasSubstr("'a.h5' beside it, whatever folder it names")));
  expectNear(worldOf(source->info(), {1, 1, 1}), {0.25, 0.25, 1});  // voxelSize, as nothing registers it
  EXPECT_THAT(refusal({write(bdvXml("<hdf5 type=\"relative\">a.h5</hdf5>", registration(0, 0, {"1 2 3"})))}),
              HasSubstr("ImageLoader"));
  EXPECT_THAT(refusal({scratch.write("in/b.xml",
                                     bdvXml("<hdf5 type=\"relative\">a.h5</hdf5>", registration(0, 0, {"1 2 3"})))}),
              HasSubstr("affine '1 2 3' must have 12 finite numbers"));
}

TEST(Nexus, HasSignalAndScales) {
  const Scratch scratch;
  const DatasetKind real{.type = H5T_IEEE_F32LE, .memory = H5T_NATIVE_DOUBLE};
  Hdf5Writer writer(scratch.path("scan.nxs"));
  const Extent shape = {3, 4, 5};
  writer.dataset("entry/raw/frames", shape, countedUp(60));
  writer.dataset("entry/result/counts", shape, std::vector<int>(60, 9), {.type = H5T_STD_U32BE});
  writer.dataset<double>("entry/result/z", {3}, {1, 2, 3}, real);
  writer.dataset<double>("entry/result/y", {4}, {0, 500, 1000, 1500}, real);
  writer.dataset<double>("entry/result/x", {6}, {0, 1, 2, 3, 4, 5}, real);  // edges
  writer.text("entry/result/z", "units", "mm");
  writer.text("entry/result/y", "units", "um");
  writer.text("entry/result/x", "units", "mm");
  writer.text("entry", "NX_class", "NXentry");
  writer.text("entry", "default", "result");
  writer.text("/", "default", "entry");
  for (const char* group : {"entry/raw", "entry/result"}) writer.text(group, "NX_class", "NXdata");
  writer.text("entry/raw", "signal", "frames");
  writer.text("entry/result", "signal", "counts");
  writer.text("entry/result/counts", "units", "1/s");
  writer.texts("entry/result", "axes", {"z", "y", "x"});
  const auto path = writer.close();
  const auto source = openSource({path}, {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(dataValues(*source), std::vector<double>(60, 9));
  expectNear(worldOf(info, {0.5, 0.5, 0.5}), {0.5, 0, 1});
  expectNear(worldOf(info, {1.5, 1.5, 1.5}), {1.5, 0.5, 2});
  EXPECT_EQ(info.channels[0].unit, "1/s");
  EXPECT_THAT(info.notes, Contains(HasSubstr("of 2 groups of data it is 'entry/result'; --dataset chooses another")));
  EXPECT_EQ(dataValues(*openSource({path}, choosing({.dataset = "entry/raw"}))), doubles(countedUp(60)));
  EXPECT_EQ(dataValues(*openSource({path}, choosing({.dataset = "entry/raw/frames"}))), doubles(countedUp(60)));
}

TEST(Nexus, OfOldHasSignalsByNumberAndTellsOfUnevenScales) {
  const Scratch scratch;
  const DatasetKind real{.type = H5T_IEEE_F64BE, .memory = H5T_NATIVE_DOUBLE};
  Hdf5Writer writer(scratch.path("old.nxs"));
  writer.dataset("entry1/data/counts", {3, 4, 5}, countedUp(60));
  writer.numbers("entry1/data/counts", "signal", {1});
  writer.text("entry1/data/counts", "axes", "theta:y:x");
  writer.dataset<double>("entry1/data/theta", {3}, {1, 2, 5}, real);
  writer.dataset<double>("entry1/data/y", {4}, {0, 2, 4, 6}, real);
  writer.dataset<double>("entry1/data/x", {5}, {4, 3, 2, 1, 0}, real);
  writer.text("entry1", "NX_class", "NXentry");
  writer.text("entry1/data", "NX_class", "NXdata");
  const auto source = openSource({writer.close()}, {});
  EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("'entry1/data/theta', are not one step apart"),
                                                HasSubstr("step along z is not said")));
  expectNear(worldOf(source->info(), {0.5, 0.5, 0.5}), {4, 0, 0});
  expectNear(worldOf(source->info(), {1.5, 1.5, 1.5}), {3, 2, 1.5});
}

TEST(Itk, HasDirections) {
  const Scratch scratch;
  const DatasetKind real{.type = H5T_IEEE_F64LE, .memory = H5T_NATIVE_DOUBLE};
  Hdf5Writer writer(scratch.path("itk.h5"));
  writer.dataset("ITKImage/0/VoxelData", {3, 4, 5}, countedUp(60), {.type = H5T_STD_I16LE});
  writer.dataset<double>("ITKImage/0/Spacing", {3}, {1, 2, 3}, real);
  writer.dataset<double>("ITKImage/0/Origin", {3}, {10, 20, 30}, real);
  writer.dataset<double>("ITKImage/0/Directions", {3, 3}, {0, 1, 0, -1, 0, 0, 0, 0, 1}, real);
  const auto source = openSource({writer.close()}, {});
  EXPECT_EQ(source->info().space, "left-posterior-superior");
  expectNear(worldOf(source->info(), {0.5, 0.5, 0.5}), {10, 20, 30});
  expectNear(worldOf(source->info(), {1.5, 0.5, 0.5}), {10, 21, 30});
  expectNear(worldOf(source->info(), {0.5, 1.5, 0.5}), {8, 20, 30});
  EXPECT_EQ(dataValues(*source), doubles(countedUp(60)));
}

// Tensors: six values a voxel are no axis of space, though none of the others is as short as channels are.
TEST(Itk, ValuesOfAVoxelAreChannels) {
  const Scratch scratch;
  const DatasetKind real{.type = H5T_IEEE_F64LE, .memory = H5T_NATIVE_DOUBLE};
  Hdf5Writer writer(scratch.path("itk.h5"));
  writer.dataset("ITKImage/0/VoxelData", {10, 11, 12, 6}, countedUp(7920), {.type = H5T_STD_I16LE});
  writer.dataset<int>("ITKImage/0/Dimension", {3}, {12, 11, 10}, {.type = H5T_STD_U64LE});
  writer.dataset<double>("ITKImage/0/Spacing", {3}, {2, 3, 4}, real);
  writer.dataset<double>("ITKImage/0/Origin", {3}, {0, 0, 0}, real);
  const auto source = openSource({writer.close()}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(12, 11, 10));
  EXPECT_EQ(source->info().channels.size(), 4u);
  EXPECT_THAT(source->info().notes, testing::Contains(testing::HasSubstr("of 6 channels it has the first 4")));
  EXPECT_EQ(source->info().world_from_index[0][0], 2);
}

// Groups that lead back to themselves are looked at so often and no more.
TEST(Nexus, LoopsEnd) {
  const Scratch scratch;
  Hdf5Writer writer(scratch.path("loop.h5"));
  writer.text("/", "NX_class", "NXroot");
  for (int i = 0; i < 64; ++i) {
    H5Lcreate_hard(writer.file(), "/", writer.file(), fmt::format("loop{}", i).c_str(), H5P_DEFAULT, H5P_DEFAULT);
  }
  writer.dataset("voxels", {2, 3, 4}, countedUp(24), {.type = H5T_STD_I16LE});
  ImportOptions options;
  options.dataset = "voxels";
  EXPECT_EQ(openSource({writer.close()}, options)->info().dims, glm::ivec3(4, 3, 2));
}

}  // namespace
}  // namespace blockwalk::volume_test
#endif
