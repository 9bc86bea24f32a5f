// SPDX-License-Identifier: Apache-2.0
// Real files of every format, against the figures that are published with them.
#include <cctype>
#include <cmath>
#include <limits>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

struct RealVolume {
  const char* file;
  const char* dims_and_type;
  double lowest;
  double highest;
  double threshold;
  double share;        // of voxels above the threshold
  glm::ivec3 dims{0};  // where the file does not say them
  const char* type = nullptr;
};

// Read by the test's name.
void PrintTo(const RealVolume& volume, std::ostream* out) { *out << volume.file; }

const RealVolume kVolumes[] = {
    {"nrrd_set/FLAIR.nrrd", "124x160x140 u8", 0, 255, 12, 0.3780},
    {"nrrd_set/template_T2.nrrd", "117x159x126 f32", 0, 710.678, 72, 0.0823},
    {"nrrd_set/hncma-atlas.nrrd", "256x256x256 u16", 0, 4100, 0, 0.1028},
    {"nrrd_set/bunnyPadded.nrrd", "258x258x182 u8", 0, 255, 0, 0.1340},
    {"nrrd_set/LHMask.nrrd", "50x50x50 u8", 0, 1, 0, 0.2294},
    {"nrrd_set/FCWB_2um_mask.nrrd", "282x164x54 u8", 0, 255, 0, 0.2318},
    {"nrrd_set/tooth.nhdr", "103x94x161 u16", 0, 1300, 500, 0.2729},
    {"nrrd_set/pynrrd/BallBinary30x30x30.nhdr", "30x30x30 u16", 0, 257, 0, 0.53067},
    {"nrrd_set/pynrrd/BallBinary30x30x30.nrrd", "30x30x30 u16", 0, 257, 0, 0.53067},
    {"nrrd_set/pynrrd/BallBinary30x30x30_gz.nrrd", "30x30x30 u16", 0, 257, 0, 0.53067},
    {"nrrd_set/pynrrd/BallBinary30x30x30_gz_lineskip.nrrd", "30x30x30 u16", 0, 257, 0, 0.53067},
    {"nrrd_set/pynrrd/BallBinary30x30x30_gz_byteskip_minus_one.nrrd", "30x30x30 u16", 0, 257, 0, 0.53067},
    {"nrrd_set/pynrrd/BallBinary30x30x30_byteskip_minus_one.nhdr", "30x30x30 u16", 0, 257, 0, 0.53067},
    {"nrrd_set/pynrrd/BallBinary30x30x30_byteskip_minus_one_nifti.nhdr", "30x30x30 u16", 0, 257, 0, 0.53067},
    {"nrrd_set/pynrrd/test1d_ascii.nrrd", "27x1x1 u8", 1, 27, 0, 1},
    {"nrrd_set/pynrrd/test2d_ascii.nrrd", "3x9x1 u16", 1, 27, 0, 1},
    {"metaimage_set/aorta.mha", "157x393x34 f32", 0, 2570.2, 600, 0.0537},
    {"metaimage_set/head.mha", "64x64x93 u16", 0, 3926, 500, 0.3805},
    {"metaimage_set/fuel.mha", "68x68x68 u8", 0, 255, 12, 0.0233},
    {"metaimage_set/hydrogenAtom.mha", "128x128x128 u8", 0, 250, 12, 0.0707},
    {"metaimage_set/neghip.mha", "70x70x70 u8", 0, 255, 25, 0.1325},
    {"metaimage_set/nucleon.mha", "41x41x41 u8", 0, 249, 25, 0.3631},
    {"metaimage_set/silicium.mha", "104x40x40 u8", 0, 255, 25, 0.2746},
    {"metaimage_set/marschnerlobb.mha", "43x43x43 u8", 0, 255, 25, 0.7863},
    {"frog_rgb/frogtissue.mhd", "500x470x136 u8", 0, 29, 0, 0.0362},
    {"frog_rgb/color_png", "640x482x36 rgba8", 0, 255, 24, 0.8648},
    {"frog_rgb/masks_tiff/skeletonMasks.tiff", "500x470x136 u8", 0, 1, 0, 0.0138},
    {"tiff_stacks/xyz_8bit__mri_head.tif", "186x226x27 u8", 0, 255, 25, 0.5426},
    {"tiff_stacks/cellfinder", "627x1116x2 u16", 0, 3529, 600, 0.0065},
    {"broken_odd/odd/hopper_bigtiff.tif", "128x128x1 rgba8", 3, 255, 0, 1},
    {"broken_odd/odd/predictor-3-gray-f32.tif", "200x200x1 f32", 0, 0.999264, 0, 0.9975},
    {"cell_rgb_atlas/AICS-10_5_5.ome.tif_atlas_2.png", "204x292x65 rgba8", 0, 255, 10, 0.0662, {204, 292, 65}},
    {"voraldo_rgba/grass.png", "256x256x256 rgba8", 0, 74, 0, 0.1715, {256, 256, 256}},
    {"ct_classic_u8/engine_256x256x128_uint8.raw.gz", "256x256x128 u8", 0, 255, 40, 0.1517, {256, 256, 128}, "u8"},
};

class ImportData : public testing::TestWithParam<RealVolume> {};

TEST_P(ImportData, HasThePublishedFigures) {
  const auto folder = realData();
  if (!folder) GTEST_SKIP() << "no real data: set BLOCKWALK_DATA to its folder";
  const RealVolume& expected = GetParam();
  ImportOptions options;
  if (expected.dims.x > 0) options.dims = expected.dims;
  if (expected.type != nullptr) options.type = expected.type;
  // Published shares of colour without alpha count voxels of which any channel is bright.
  const bool opaque = std::string_view(expected.dims_and_type).ends_with("rgba8") && expected.highest == 255;
  if (opaque) options.density = DensityRule::max;
  const auto source = openSource({*folder / expected.file}, options);
  const SourceInfo& info = source->info();
  EXPECT_EQ(fmt::format("{}x{}x{} {}", info.dims.x, info.dims.y, info.dims.z, voxelTypeName(info.type)),
            expected.dims_and_type);
  const std::string voxels = readAll(*source, 64);
  const std::size_t width = voxelBytes(info.type);
  double lowest = std::numeric_limits<double>::max();
  double highest = -lowest;
  std::size_t above = 0;
  for (std::size_t i = 0; i < voxels.size(); i += width) {
    const auto* voxel = reinterpret_cast<const std::byte*>(&voxels[i]);
    const double value = info.channels[0].value_offset + static_cast<double>(storedDensity(info.type, voxel));
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
    above += value > expected.threshold ? 1 : 0;
  }
  EXPECT_NEAR(lowest, expected.lowest, 1e-3);
  EXPECT_NEAR(highest, expected.highest, 1e-3 * std::max(1.0, highest * 0.01));
  // Published to four places.
  const std::size_t count = voxels.size() / width;
  EXPECT_NEAR(static_cast<double>(above) / static_cast<double>(count), expected.share, 0.0001);
  EXPECT_EQ(source->conversion(0).nonfinite_voxels, 0u);
}

INSTANTIATE_TEST_SUITE_P(Files, ImportData, testing::ValuesIn(kVolumes), [](const auto& instance) {
  std::string name = instance.param.file;
  for (char& letter : name) {
    if (std::isalnum(static_cast<unsigned char>(letter)) == 0) letter = '_';
  }
  return name;
});

TEST(ImportData, AllBallsAreTheSameBall) {
  const auto folder = realData();
  if (!folder) GTEST_SKIP() << "no real data: set BLOCKWALK_DATA to its folder";
  const auto balls = *folder / "nrrd_set/pynrrd";
  const std::string ball = importAll(balls / "BallBinary30x30x30.nrrd");
  for (const char* name : {".nhdr", "_gz.nrrd", "_gz_lineskip.nrrd", "_gz_byteskip_minus_one.nrrd", "_bz2.nrrd",
                           "_byteskip_minus_one.nhdr", "_byteskip_minus_one_nifti.nhdr"}) {
    EXPECT_EQ(importAll(balls / ("BallBinary30x30x30" + std::string(name))), ball) << name;
  }
}

TEST(ImportData, SlicesEqualTheVolumeTheyCameFrom) {
  const auto folder = realData();
  if (!folder) GTEST_SKIP() << "no real data: set BLOCKWALK_DATA to its folder";
  const std::string slices = importAll(*folder / "microtus_ct/tiff_slices");
  ASSERT_EQ(slices.size(), std::size_t{880} * 836 * 2);
  const std::size_t bright =
      static_cast<std::size_t>(std::count_if(slices.begin(), slices.end(), [](char value) { return value != 0; }));
  EXPECT_EQ(std::lround(1e4 * static_cast<double>(bright) / static_cast<double>(slices.size())), 873);
}

TEST(ImportData, AHyperstackHasItsChannels) {
  const auto folder = realData();
  if (!folder) GTEST_SKIP() << "no real data: set BLOCKWALK_DATA to its folder";
  const auto source = openSource({*folder / "tiff_stacks/xyzc_16bit__dna_conf_wf.tif"}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(133, 130, 45));
  EXPECT_EQ(source->info().type, VoxelType::u16);
  ASSERT_EQ(source->info().channels.size(), 2u);
  const std::string voxels = readAll(*source, 64);
  const auto* values = reinterpret_cast<const std::uint16_t*>(voxels.data());
  const std::size_t count = voxels.size() / 4;
  ASSERT_EQ(count, std::size_t{133} * 130 * 45);
  EXPECT_EQ(*std::max_element(values, values + 2 * count), 61711);
  std::size_t bright = 0;  // in either channel, as the share was published
  for (std::size_t i = 0; i < count; ++i) bright += values[i] > 6000 || values[count + i] > 6000 ? 1 : 0;
  EXPECT_NEAR(static_cast<double>(bright) / static_cast<double>(count), 0.0148, 0.0001);
}

TEST(ImportData, ColoursBecomeChannelsOnRequest) {
  const auto folder = realData();
  if (!folder) GTEST_SKIP() << "no real data: set BLOCKWALK_DATA to its folder";
  ImportOptions options;
  options.dims = glm::ivec3(204, 292, 65);
  const auto atlas = *folder / "cell_rgb_atlas/AICS-10_5_5.ome.tif_atlas_2.png";
  const std::string colors = importAll(atlas, options);
  options.channels = ChannelRule::fields;
  options.channel_names = {"SEG_DNA", "CON_Memb", "CON_DNA"};
  const auto source = openSource({atlas}, options);
  EXPECT_EQ(source->info().type, VoxelType::u8);
  ASSERT_EQ(source->info().channels.size(), 3u);
  EXPECT_EQ(source->info().channels[2].name, "CON_DNA");
  const std::string fields = readAll(*source);
  const std::size_t count = colors.size() / 4;
  ASSERT_EQ(fields.size(), 3 * count);
  for (std::size_t c = 0; c < 3; ++c) {
    std::string own(count, '\0');
    for (std::size_t i = 0; i < count; ++i) own[i] = colors[4 * i + c];
    EXPECT_TRUE(fields.compare(c * count, count, own) == 0) << c;
  }
}

TEST(ImportData, RefusesWhatIsNoSingleVolume) {
  const auto folder = realData();
  if (!folder) GTEST_SKIP() << "no real data: set BLOCKWALK_DATA to its folder";
  const std::pair<const char*, const char*> cases[] = {
      {"tiff_stacks/multipage_rgb.tif", "colour must be u8 or u16"},
      {"nrrd_set/pynrrd/BallBinary30x30x30_byteskip_minus_five.nhdr", "byte skip"},
      {"nrrd_set/pynrrd/BallBinary30x30x30_nifti.nhdr", "54352 bytes, 54000"},
  };
  for (const auto& [file, expected] : cases) EXPECT_THAT(refusal({*folder / file}), HasSubstr(expected)) << file;
}

// Files from parsers' own test suites: refused with a message, or rescued into a picture.
TEST(ImportData, SurvivesBrokenFiles) {
  const auto folder = realData();
  if (!folder) GTEST_SKIP() << "no real data: set BLOCKWALK_DATA to its folder";
  int refused = 0;
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(*folder / "broken_odd")) {
    if (!entry.is_regular_file()) continue;
    ++files;
    try {
      readAll(*openSource({entry.path()}, {}));
    } catch (const DataError& error) {
      ++refused;
      EXPECT_THAT(error.what(), HasSubstr(entry.path().filename().string()));
    }
  }
  EXPECT_GE(files, 20);
  EXPECT_GE(refused, 16);
}

}  // namespace
}  // namespace blockwalk
