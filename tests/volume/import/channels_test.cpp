// SPDX-License-Identifier: Apache-2.0
// Files whose voxels have several values: which become channels, and in what order they lie.
#include "tests/volume/import/import_scratch.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

// Channel after channel, what `interleaved` holds voxel after voxel.
std::string inPlanes(const std::string& interleaved, std::size_t channels, std::size_t width) {
  std::string planes;
  for (std::size_t c = 0; c < channels; ++c) {
    for (std::size_t i = c * width; i < interleaved.size(); i += channels * width)
      planes += interleaved.substr(i, width);
  }
  return planes;
}

std::string nrrd(const std::string& type, const std::string& sizes, const std::string& rest) {
  const auto axes = std::count(sizes.begin(), sizes.end(), ' ') + 1;
  return "NRRD0005\ntype: " + type + "\ndimension: " + std::to_string(axes) + "\nsizes: " + sizes +
         "\nendian: little\nencoding: raw\n" + rest + "\n";
}

std::string metaImage(const std::string& type, int channels) {
  return "ObjectType = Image\nNDims = 3\nDimSize = 3 2 2\nElementType = " + type +
         "\nElementNumberOfChannels = " + std::to_string(channels) + "\nElementDataFile = LOCAL\n";
}

std::string countingWords(std::size_t count) {
  std::vector<std::uint16_t> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = static_cast<std::uint16_t>(i * 257 + 11);
  return bytesOf(values);
}

TEST(ImportChannels, RawInterleavedAndPlanar) {
  const Scratch scratch;
  ImportOptions options;
  options.dims = glm::ivec3(3, 5, 4);
  options.type = "u16";
  options.raw_channels = 3;
  options.channel_names = {"a", "b", "c"};
  const std::string voxels = countingWords(3 * 60);
  const std::string planes = inPlanes(voxels, 3, 2);
  const auto source = openSource({scratch.write("i.raw", voxels)}, options);
  EXPECT_EQ(source->info().type, VoxelType::u16);
  ASSERT_EQ(source->info().channels.size(), 3u);
  EXPECT_EQ(source->info().channels[2].name, "c");
  EXPECT_EQ(readAll(*source), planes);
  EXPECT_EQ(importAll(scratch.write("i.raw.gz", gzipped(voxels)), options), planes);
  options.big_endian = true;
  EXPECT_EQ(importAll(scratch.write("b.raw", swapped(voxels, 2)), options), planes);
  options.big_endian = false;
  options.planar = true;
  EXPECT_EQ(importAll(scratch.write("p.raw", planes), options), planes);
  EXPECT_EQ(importAll(scratch.write("p.raw.gz", gzipped(planes)), options), planes);
  EXPECT_THAT(refusal({scratch.write("short.raw", planes.substr(2))}, options), HasSubstr("3 x u16"));
}

TEST(ImportChannels, SignedAndWideRawKeepTheirValues) {
  const Scratch scratch;
  ImportOptions options;
  options.dims = glm::ivec3(2, 1, 1);
  options.raw_channels = 2;
  options.type = "i8";
  const auto bytes = openSource({scratch.write("a", bytesOf<std::int8_t>({-128, 0, 5, 127}))}, options);
  EXPECT_EQ(bytes->info().channels[1].value_offset, -128);
  EXPECT_EQ(readAll(*bytes), bytesOf<std::uint8_t>({0, 133, 128, 255}));
  options.type = "f64";
  const auto wide = openSource({scratch.write("b", bytesOf<double>({1, 0.1, 2, NAN}))}, options);
  EXPECT_EQ(readAll(*wide).substr(0, 8), bytesOf<float>({1, 2}));
  EXPECT_EQ(wide->conversion(0).largest_rounding, 0);
  EXPECT_GT(wide->conversion(1).largest_rounding, 0);
  EXPECT_EQ(wide->conversion(0).nonfinite_voxels, 0u);
  EXPECT_EQ(wide->conversion(1).nonfinite_voxels, 1u);
}

TEST(ImportChannels, RawSaysWhatDoesNotGoTogether) {
  const Scratch scratch;
  ImportOptions options;
  options.dims = glm::ivec3(1, 1, 1);
  options.type = "rgb8";
  const auto file = scratch.write("a.raw", "abc");
  options.raw_channels = 2;
  EXPECT_THAT(refusal({file}, options), HasSubstr("already 3 samples"));
  options.raw_channels = 1;
  options.planar = true;
  EXPECT_THAT(refusal({file}, options), HasSubstr("planar"));
  options.planar = false;
  options.channels = ChannelRule::fields;
  EXPECT_EQ(openSource({file}, options)->info().channels.size(), 3u);
  options.channel_names = {"one"};
  EXPECT_THAT(refusal({file}, options), HasSubstr("1 are given, there are 3"));
  options.type = "u8";
  options.dims = glm::ivec3(3, 1, 1);
  EXPECT_THAT(refusal({file}, options), HasSubstr("one channel, which has no name"));
  options.channel_names.clear();
  options.channels = ChannelRule::color;
  EXPECT_THAT(refusal({file}, options), HasSubstr("single values"));
}

TEST(ImportChannels, NrrdListsInFrontAndBehind) {
  const Scratch scratch;
  const std::string voxels = countingWords(2 * 12);
  const std::string planes = inPlanes(voxels, 2, 2);
  const std::string front =
      "kinds: list domain domain domain\nspace directions: none (2,0,0) (0,3,0) (0,0,4)\nspace: "
      "left-posterior-superior\n";
  const auto source = openSource({scratch.write("a", nrrd("ushort", "2 3 2 2", front) + voxels)}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(3, 2, 2));
  ASSERT_EQ(source->info().channels.size(), 2u);
  EXPECT_EQ(source->info().world_from_index[1][1], 3);
  EXPECT_EQ(readAll(*source), planes);
  const auto behind = openSource(
      {scratch.write("b",
                     nrrd("ushort", "3 2 2 2", "kinds: domain domain domain vector\nspacings: 2 3 4 nan\n") + planes)},
      {});
  EXPECT_EQ(behind->info().dims, glm::ivec3(3, 2, 2));
  EXPECT_EQ(behind->info().world_from_index[2][2], 4);
  EXPECT_EQ(readAll(*behind), planes);
  const auto slice =
      openSource({scratch.write("c", nrrd("ushort", "2 3 4", "kinds: 2-vector domain domain\n") + voxels)}, {});
  EXPECT_EQ(slice->info().dims, glm::ivec3(3, 4, 1));
  EXPECT_EQ(slice->info().channels.size(), 2u);
}

TEST(ImportChannels, NrrdColourStaysColourUnlessAskedOtherwise) {
  const Scratch scratch;
  const std::string pixels = bytesOf<std::uint8_t>({1, 2, 3, 4, 5, 6});
  for (const char* kinds : {"kinds: RGB-color domain domain domain\n", "kinds: vector domain domain domain\n", ""}) {
    const auto file = scratch.write("a", nrrd("uchar", "3 2 1 1", kinds) + pixels);
    EXPECT_EQ(openSource({file}, {})->info().type, VoxelType::rgba8) << kinds;
    ImportOptions options;
    options.channels = ChannelRule::fields;
    EXPECT_EQ(importAll(file, options), bytesOf<std::uint8_t>({1, 4, 2, 5, 3, 6})) << kinds;
  }
  const auto reals = scratch.write(
      "b", nrrd("float", "3 2 1 1", "kinds: vector domain domain domain\n") + bytesOf<float>({1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(importAll(reals), bytesOf<float>({1, 4, 2, 5, 3, 6}));
  ImportOptions color;
  color.channels = ChannelRule::color;
  EXPECT_THAT(refusal({reals}, color), HasSubstr("colour must be u8 or u16"));
}

TEST(ImportChannels, MetaImageChannels) {
  const Scratch scratch;
  const std::string voxels = countingWords(2 * 12);
  EXPECT_EQ(importAll(scratch.write("a.mha", metaImage("MET_USHORT", 2) + voxels)), inPlanes(voxels, 2, 2));
  const auto reals = openSource({scratch.write("b.mha", metaImage("MET_FLOAT", 3) + std::string(144, '\0'))}, {});
  EXPECT_EQ(reals->info().channels.size(), 3u);
  const auto colors = scratch.write("c.mha", metaImage("MET_UCHAR", 4) + voxels);
  EXPECT_EQ(openSource({colors}, {})->info().type, VoxelType::rgba8);
  ImportOptions options;
  options.channels = ChannelRule::fields;
  EXPECT_EQ(importAll(colors, options), inPlanes(voxels, 4, 1));
  options.density = DensityRule::max;
  EXPECT_THAT(refusal({colors}, options), HasSubstr("density"));
}

TEST(ImportChannels, AFileAChannel) {
  const Scratch scratch;
  const std::string first = countingWords(12);
  const std::string second = swapped(first, 2);
  const auto a = scratch.write("dapi.nrrd", nrrd("ushort", "3 2 2", "spacings: 1 2 3\n") + first);
  const auto b = scratch.write("gfp.nrrd", nrrd("ushort", "3 2 2", "spacings: 1 2 3.00001\n") + second);
  ImportOptions options;
  options.channels = ChannelRule::separate;
  const auto source = openSource({b, a}, options);  // in the order that they are named
  ASSERT_EQ(source->info().channels.size(), 2u);
  EXPECT_EQ(source->info().channels[0].name, "gfp");
  EXPECT_EQ(source->info().channels[1].name, "dapi");
  EXPECT_EQ(readAll(*source), second + first);
  options.channel_names = {"green", "blue"};
  EXPECT_EQ(openSource({b, a}, options)->info().channels[1].name, "blue");
  options.channel_names.clear();
  EXPECT_THAT(refusal({a}, options), HasSubstr("1 sources, must be 2..4"));
  const auto small = scratch.write("small.nrrd", nrrd("ushort", "3 2 1", "") + first.substr(12));
  EXPECT_THAT(refusal({a, small}, options), HasSubstr("3 x 2 x 1 voxels of u16, but dapi.nrrd has 3 x 2 x 2"));
  const auto bytes = scratch.write("bytes.nrrd", nrrd("uchar", "3 2 2", "") + first.substr(12));
  EXPECT_THAT(refusal({a, bytes}, options), HasSubstr("of u8, but"));
  const auto apart = scratch.write("apart.nrrd", nrrd("ushort", "3 2 2", "spacings: 1 2 3.1\n") + first);
  EXPECT_THAT(refusal({a, apart}, options), HasSubstr("elsewhere in the world"));
  const auto color = scratch.write("c.nrrd", nrrd("uchar", "3 1 2 2", "") + first.substr(12));
  EXPECT_THAT(refusal({color, a}, options), HasSubstr("single values"));
}

}  // namespace
}  // namespace blockwalk
