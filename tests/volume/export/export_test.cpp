// SPDX-License-Identifier: Apache-2.0
// What import makes of an export is the volume that was exported: voxels, place, units, names and values.
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/volume/allocations.h"
#include "tests/volume/export/export_scratch.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

const ExportFormat kFormats[] = {ExportFormat::nrrd, ExportFormat::nifti, ExportFormat::tiff, ExportFormat::zarr,
                                 ExportFormat::npy,  ExportFormat::raw,   ExportFormat::png,  ExportFormat::prism};

class ExportShapes : public testing::TestWithParam<Shape> {
 protected:
  // A random volume, in the file "v.bwv", that says it came from `name`.
  void build(const std::string& name, const std::string& kind, bool has_place) {
    const Shape& shape = GetParam();
    MemorySource source = randomSource(shape.type, shape.dims, 5, shape.threshold < 0, shape.channels);
    SourceInfo& info = source.change();
    info.name = name;
    info.format = kind;
    info.world_from_index =
        glm::dmat4(glm::dvec4(0.7, 0, 0, 0), glm::dvec4(0, 0.1, 0, 0), glm::dvec4(0, 0, 3, 0), glm::dvec4(0, 0, 0, 1));
    if (has_place) describe(info);
    buildShape(shape, source, folder_ / "v.bwv");
  }

  // Oblique, and with everything that people may want to know.
  static void describe(SourceInfo& info) {
    info.world_from_index = glm::dmat4(glm::dvec4(0.1, 0.7, 0, 0), glm::dvec4(-0.3, 0.2, 1e-3, 0),
                                       glm::dvec4(1.0 / 3, 0, -2.9, 0), glm::dvec4(-123.456, 1e-7, 1e6 / 7, 1));
    info.space = info.channels.size() == 1 ? "left-posterior-superior" : "a bench \\ a \"corner\"";
    info.length_unit = info.channels.size() == 1 ? "mm" : "the width of a human hair";
    for (std::size_t i = 0; i < info.channels.size(); ++i) {
      SourceChannel& channel = info.channels[i];
      channel.unit = info.channels.size() == 3 ? "HU" : fmt::format("unit {}", i);
      if (info.channels.size() > 1) channel.name = fmt::format("channel \\{} µ", i);
      if (info.type == VoxelType::rgba8) continue;
      channel.color = {{1, 2, static_cast<std::uint8_t>(250 + i)}};
      channel.value_scale = 0.1 * static_cast<double>(i + 1);
      channel.value_offset = i == 1 ? 0 : -7.25;
    }
  }

  ScratchFolder folder_{};
};

TEST_P(ExportShapes, NrrdKeepsEverything) {
  build("out.nrrd", "nrrd", true);
  const ExportReport report = exportVolume(VolumeFile(folder_ / "v.bwv"), folder_ / "out.nrrd", {});
  EXPECT_EQ(report.bytes, std::filesystem::file_size(folder_ / "out.nrrd"));
  EXPECT_THAT(report.notes, testing::IsEmpty());
  importAgain(folder_ / "out.nrrd", report, folder_ / "w.bwv", GetParam().subblock_side);
  EXPECT_TRUE(importedContents(folder_ / "w.bwv") == readContents(folder_ / "v.bwv"));
  EXPECT_EQ(VolumeFile(folder_ / "w.bwv").info().world_from_index,
            VolumeFile(folder_ / "v.bwv").info().world_from_index);
}

TEST_P(ExportShapes, RawKeepsVoxelsAndSpacing) {
  build("out.raw", "raw", false);
  const ExportReport report =
      exportVolume(VolumeFile(folder_ / "v.bwv"), folder_ / "out.raw", {.format = ExportFormat::raw});
  EXPECT_THAT(report.notes, testing::IsEmpty());
  importAgain(folder_ / "out.raw", report, folder_ / "w.bwv", GetParam().subblock_side);
  EXPECT_TRUE(importedContents(folder_ / "w.bwv") == readContents(folder_ / "v.bwv"));
}

TEST_P(ExportShapes, PrismKeepsVoxelsAndSpacingOfOneIntegerChannel) {
  build("out.prism", "prism", false);
  const ExportOptions options{.format = ExportFormat::prism};
  const Shape& shape = GetParam();
  if ((shape.type != VoxelType::u8 && shape.type != VoxelType::u16) || shape.channels > 1) {
    EXPECT_THAT(exportRefusal(folder_ / "v.bwv", folder_ / "out.prism", options), HasSubstr("PRISM has"));
    EXPECT_EQ(namesIn(folder_.path), std::set<std::string>{"v.bwv"});
    return;
  }
  const ExportReport report = exportVolume(VolumeFile(folder_ / "v.bwv"), folder_ / "out.prism", options);
  EXPECT_THAT(report.notes, testing::IsEmpty());
  importAgain(folder_ / "out.prism", report, folder_ / "w.bwv", shape.subblock_side);
  EXPECT_TRUE(importedContents(folder_ / "w.bwv") == readContents(folder_ / "v.bwv"));
}

// Every voxel of a box, against the level as a whole.
TEST_P(ExportShapes, ABoxOfALevelIsACutOfTheLevel) {
  build("v", "v", true);
  const VolumeFile file(folder_ / "v.bwv");
  const VolumeInfo& info = file.info();
  const std::size_t width = voxelBytes(info.type);
  for (int level = 0; level < std::min<int>(3, static_cast<int>(info.levels.size())); ++level) {
    const glm::ivec3 dims = info.level(level, Form::values).dims;
    const VoxelBox box{dims / 3, glm::max(dims / 3 + 1, dims - 1)};
    std::vector<int> channels;
    for (int i = static_cast<int>(info.channels.size()); i-- > 0;) channels.push_back(i);
    const ExportOptions options{.format = ExportFormat::raw, .level = level, .box = box, .channels = channels};
    EXPECT_EQ(exportVolume(file, folder_ / "cut.raw", options).dims, box.dims());
    std::string expected;
    for (const int channel : channels) {
      const DenseLevel dense = readDense(file, level, channel);
      const float empty = emptyValue(info.type, info.channels[static_cast<std::size_t>(channel)]);
      for (int z = box.begin.z; z < box.end.z; ++z) {
        for (int y = box.begin.y; y < box.end.y; ++y) {
          for (int x = box.begin.x; x < box.end.x; ++x) {
            const auto at = static_cast<std::size_t>(x + dims.x * (y + dims.y * z));
            std::uint32_t bits = static_cast<std::uint32_t>(empty);
            if (info.type == VoxelType::f32) std::memcpy(&bits, &empty, 4);
            if (dense.stored[at]) std::memcpy(&bits, &dense.voxels[at * width], width);
            expected.append(reinterpret_cast<const char*>(&bits), width);
          }
        }
      }
    }
    EXPECT_TRUE(readBytes(folder_ / "cut.raw") == expected) << level;

    ExportOptions nrrd = options;
    nrrd.format = ExportFormat::nrrd;
    exportVolume(file, folder_ / "cut.nrrd", nrrd);
    const auto source = openSource({folder_ / "cut.nrrd"}, {});
    const double voxel = std::exp2(level);
    for (const glm::dvec3& corner : {glm::dvec3(0), glm::dvec3(box.dims())}) {
      const glm::dvec3 expected_world(info.world_from_index *
                                      glm::dvec4((glm::dvec3(box.begin) + corner) * voxel, 1.0));
      const glm::dvec3 world(source->info().world_from_index * glm::dvec4(corner, 1.0));
      EXPECT_LT(glm::length(world - expected_world), 1e-9) << level;
    }
    for (std::size_t i = 0; i < channels.size(); ++i) {
      const ChannelInfo& channel = info.channels[static_cast<std::size_t>(channels[i])];
      EXPECT_EQ(source->info().channels[i].name, channel.name);
      EXPECT_EQ(source->info().channels[i].value_scale, channel.value_scale);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ExportShapes, testing::ValuesIn(kShapes), [](const auto& instance) {
  return fmt::format("{}_{}x{}", instance.index, instance.param.channels, voxelTypeName(instance.param.type));
});

TEST(Export, SignedValuesStaySigned) {
  for (const bool is_wide : {false, true}) {
    const ScratchFolder folder;
    MemorySource source(is_wide ? VoxelType::u16 : VoxelType::u8, {3, 2, 1});
    source.change().channels[0].value_offset = is_wide ? -32768 : -128;
    for (int i = 0; i < 6; ++i) {  // -2..3, as import stores them
      const int value = i - 2 + (is_wide ? 32768 : 128);
      if (is_wide) {
        source.set({i % 3, i / 3, 0}, static_cast<std::uint16_t>(value));
      } else {
        source.set({i % 3, i / 3, 0}, static_cast<std::uint8_t>(value));
      }
    }
    buildVolume(source, folder / "v.bwv", {});
    const VolumeFile file(folder / "v.bwv");
    const std::string expected =
        is_wide ? std::string("\xfe\xff\xff\xff\0\0\1\0\2\0\3\0", 12) : std::string("\xfe\xff\0\1\2\3", 6);
    const ExportReport raw = exportVolume(file, folder / "a.raw", {.format = ExportFormat::raw});
    EXPECT_EQ(readBytes(folder / "a.raw"), expected);
    EXPECT_THAT(raw.import_flags, HasSubstr(is_wide ? "--type i16" : "--type i8"));
    EXPECT_THAT(raw.import_flags, HasSubstr("--empty -2"));
    const ExportReport nrrd = exportVolume(file, folder / "a.nrrd", {});
    EXPECT_THAT(readBytes(folder / "a.nrrd"), HasSubstr(is_wide ? "type: int16\n" : "type: int8\n"));
    for (const auto& [path, report] : {std::pair{folder / "a.raw", raw}, {folder / "a.nrrd", nrrd}}) {
      importAgain(path, report, folder / "w.bwv");
      const VolumeFile again(folder / "w.bwv");
      EXPECT_EQ(again.info().channels[0].value_offset, file.info().channels[0].value_offset);
      EXPECT_EQ(readDense(again, 0).voxels, readDense(file, 0).voxels);
    }
    const ExportReport prism = exportVolume(file, folder / "a.prism", {.format = ExportFormat::prism});
    EXPECT_THAT(prism.notes, testing::ElementsAre(HasSubstr("stored ones: data = -")));
  }
}

TEST(Export, SaysWhatAFormatHasNoPlaceFor) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {9, 9, 9}, 1);
  source.change().length_unit = "mm";
  source.change().world_from_index[3] = {1, 0, 0, 1};
  source.change().channels[0].value_scale = 2;
  buildVolume(source, folder / "v.bwv", {});
  const VolumeFile file(folder / "v.bwv");
  EXPECT_THAT(exportVolume(file, folder / "a.nrrd", {}).notes, testing::IsEmpty());
  for (const ExportFormat format : {ExportFormat::raw, ExportFormat::prism}) {
    const ExportReport report = exportVolume(file, folder / "a", {.format = format});
    EXPECT_THAT(report.notes,
                testing::ElementsAre(HasSubstr("place"), HasSubstr("data = 0 + 2 * value"), HasSubstr("units")));
    std::filesystem::remove_all(folder / "a");
  }
}

TEST(Export, AnyPlaceComesBackToTheLastDigit) {
  const ScratchFolder folder;
  std::mt19937 random(17);
  const auto number = [&] {
    const double sign = random() % 2 == 0 ? 1 : -1;
    return sign * std::ldexp(static_cast<double>(random()), static_cast<int>(random() % 40) - 40);
  };
  for (int i = 0; i < 40; ++i) {
    MemorySource source(VoxelType::u8, {3, 2, 1});
    glm::dmat4& place = source.change().world_from_index;
    for (int column = 0; column < 4; ++column) place[column] = {number(), number(), number(), column == 3 ? 1 : 0};
    buildVolume(source, folder / "v.bwv", {});
    exportVolume(VolumeFile(folder / "v.bwv"), folder / "a.nrrd", {});
    EXPECT_EQ(openSource({folder / "a.nrrd"}, {})->info().world_from_index, place) << i;
  }
}

TEST(Export, LabelsComeBackAsLabels) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {30, 30, 30}, 2);
  source.change().name = "a.nrrd";
  source.change().format = "nrrd";
  BuildOptions options;
  options.block_side = 3;
  options.values = ValuesRule::labels;
  buildVolume(source, folder / "v.bwv", options);
  const ExportReport report = exportVolume(VolumeFile(folder / "v.bwv"), folder / "a.nrrd", {});
  importAgain(folder / "a.nrrd", report, folder / "w.bwv");
  EXPECT_TRUE(importedContents(folder / "w.bwv") == readContents(folder / "v.bwv"));
}

TEST(Export, RefusesWhatTheVolumeHasNot) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {60, 20, 20}, 3, false, 2);
  buildVolume(source, folder / "v.bwv", {});
  std::filesystem::create_directory(folder / "there");
  const auto refused = [&](const char* out, const ExportOptions& options) {
    return exportRefusal(folder / "v.bwv", folder / out, options);
  };
  EXPECT_THAT(refused("a", {.level = 2}), HasSubstr("level: 2 is outside 0..1"));
  EXPECT_THAT(refused("a", {.level = -1}), HasSubstr("level: -1"));
  EXPECT_THAT(refused("a", {.level = 1, .box = VoxelBox{{0, 0, 0}, {31, 1, 1}}}),
              HasSubstr("box: 0..31 along axis 0 is empty or outside 0..30 of level 1"));
  EXPECT_THAT(refused("a", {.box = VoxelBox{{0, 5, 0}, {1, 5, 1}}}), HasSubstr("box: 5..5 along axis 1"));
  EXPECT_THAT(refused("a", {.box = VoxelBox{{0, 0, -1}, {1, 1, 1}}}), HasSubstr("box: -1..1 along axis 2"));
  EXPECT_THAT(refused("a", {.channels = {2}}), HasSubstr("channels: 2 is outside 0..1"));
  EXPECT_THAT(refused("a", {.channels = {1, 1}}), HasSubstr("channels: 1 is named twice"));
  for (const ExportFormat format : kFormats) {
    EXPECT_THAT(refused("there", {.format = format, .channels = {0}}), HasSubstr("is a folder"));
  }
  EXPECT_THROW(exportVolume(VolumeFile(folder / "v.bwv"), folder / "no/a.raw", {.format = ExportFormat::raw}),
               std::system_error);
  EXPECT_EQ(namesIn(folder.path), (std::set<std::string>{"there", "v.bwv"}));
}

TEST(Export, WhatFailsLeavesNothingAndTakesNothing) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u16, {90, 90, 90}, 4);
  buildVolume(source, folder / "v.bwv", {});
  std::string bytes = readBytes(folder / "v.bwv");
  bytes[bytes.size() - 100] ^= 1;  // among the last voxels of level 0
  writeBytes(folder / "v.bwv", bytes);
  writeBytes(folder / "a", "before");
  for (const ExportFormat format : kFormats) {
    for (const char* out : {"a", "b"}) {
      EXPECT_THAT(exportRefusal(folder / "v.bwv", folder / out, {.format = format}),
                  testing::AnyOf(HasSubstr("checksum"), HasSubstr("is there already")));
    }
    EXPECT_EQ(namesIn(folder.path), (std::set<std::string>{"a", "v.bwv"}));
  }
  EXPECT_EQ(readBytes(folder / "a"), "before");
}

TEST(Export, AFileTakesTheOldOnesPlace) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {5, 5, 5}, 4);
  buildVolume(source, folder / "v.bwv", {});
  writeBytes(folder / "a.raw", "before");
  exportVolume(VolumeFile(folder / "v.bwv"), folder / "a.raw", {.format = ExportFormat::raw});
  EXPECT_EQ(readBytes(folder / "a.raw").size(), 125u);
}

// A volume of 1.6 GB that holds two voxels: neither memory nor the disk takes what it is dense.
TEST(Export, TakesNeitherTheMemoryNorTheDiskOfTheDenseVolume) {
  const ScratchFolder folder;
  LongSource source(100);
  buildVolume(source, folder / "v.bwv", {});
  const VolumeFile file(folder / "v.bwv");
  for (const ExportFormat format : {ExportFormat::nrrd, ExportFormat::raw}) {
    const std::uint64_t before = allocations().bytes;
    forgetMost();
    EXPECT_GE(exportVolume(file, folder / "a", {.format = format}).bytes, std::uint64_t{1600000000});
    EXPECT_LT(allocations().most, before + (std::uint64_t{48} << 20));
    struct stat status {};
    ASSERT_EQ(::stat((folder / "a").c_str(), &status), 0);
    EXPECT_GE(status.st_size, std::int64_t{1600000000});
    EXPECT_LT(status.st_blocks * 512, std::int64_t{64} << 20) << "holes where nothing is";
  }
}

}  // namespace
}  // namespace blockwalk::volume_test
