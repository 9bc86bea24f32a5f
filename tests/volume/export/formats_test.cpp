// SPDX-License-Identifier: Apache-2.0
// Each format out and in again: what it has a place for comes back, and what it has not is told.
#include <algorithm>
#include <array>
#include <cmath>

#include "tests/volume/allocations.h"
#include "tests/volume/export/export_scratch.h"
#include "volume/export/export_stream.h"
#include "volume/export/row_reader.h"

namespace blockwalk::volume_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class FormatShapes : public testing::TestWithParam<Shape> {
 protected:
  MemorySource random(const std::string& name, const std::string& kind) {
    const Shape& shape = GetParam();
    MemorySource source = randomSource(shape.type, shape.dims, 5, shape.threshold < 0, shape.channels);
    source.change().name = name;
    source.change().format = kind;
    return source;
  }
  bool isColor() const { return GetParam().type == VoxelType::rgba8; }
  void build(MemorySource& source) { buildShape(GetParam(), source, folder_ / "v.bwv"); }

  ExportReport exportTo(const std::string& name, ExportFormat format) {
    return exportVolume(VolumeFile(folder_ / "v.bwv"), folder_.path / name, {.format = format});
  }
  // Voxels of all levels, statistics, place, units, names.
  void expectSame(const std::string& name, const ExportReport& report) {
    importAgain(folder_.path / name, report, folder_ / "w.bwv", GetParam().subblock_side);
    EXPECT_TRUE(importedContents(folder_ / "w.bwv") == readContents(folder_ / "v.bwv")) << report.import_flags;
    EXPECT_EQ(VolumeFile(folder_ / "w.bwv").info().world_from_index,
              VolumeFile(folder_ / "v.bwv").info().world_from_index);
  }

  ScratchFolder folder_{};
};

TEST_P(FormatShapes, NiftiKeepsPlaceAndUnitAndValues) {
  for (const std::string name : {"out.nii", "out.nii.gz"}) {
    MemorySource source = random(name, "nifti");
    SourceInfo& info = source.change();
    info.world_from_index = glm::dmat4(glm::dvec4(0.5, 0.75, 0, 0), glm::dvec4(-0.25, 0.125, 0.0625, 0),
                                       glm::dvec4(0.375, 0, -3, 0), glm::dvec4(-123.5, 17, 0.25, 1));
    info.space = "right-anterior-superior";
    info.length_unit = "um";
    for (SourceChannel& channel : info.channels) {
      if (isColor()) continue;
      channel.value_scale = 0.5;
      channel.value_offset = -7.25;
    }
    build(source);
    const ExportReport report = exportTo(name, ExportFormat::nifti);
    EXPECT_THAT(report.notes, IsEmpty());
    EXPECT_EQ(report.bytes, std::filesystem::file_size(folder_.path / name));
    expectSame(name, report);
  }
}

TEST_P(FormatShapes, TiffKeepsSpacingOriginAndValues) {
  MemorySource source = random("out.tif", "tiff");
  SourceInfo& info = source.change();
  info.world_from_index =
      glm::dmat4(glm::dvec4(0.5, 0, 0, 0), glm::dvec4(0, 0.25, 0, 0), glm::dvec4(0, 0, 3, 0), glm::dvec4(-8, 2, 30, 1));
  info.length_unit = "um";
  for (SourceChannel& channel : info.channels) {
    if (isColor()) continue;
    channel.value_scale = 0.1;
    channel.value_offset = -7.3;
    channel.unit = "HU";
  }
  build(source);
  const ExportReport report = exportTo("out.tif", ExportFormat::tiff);
  EXPECT_THAT(report.notes, IsEmpty());
  EXPECT_EQ(report.bytes, std::filesystem::file_size(folder_ / "out.tif"));
  expectSame("out.tif", report);
}

TEST_P(FormatShapes, ZarrKeepsPlaceUnitsNamesAndColors) {
  MemorySource source = random("out.zarr", "zarr");
  SourceInfo& info = source.change();
  info.world_from_index = glm::dmat4(glm::dvec4(0.5, 0, 0, 0), glm::dvec4(0, 0.25, 0, 0), glm::dvec4(0, 0, 3, 0),
                                     glm::dvec4(-8, 0.0625, 30, 1));
  info.length_unit = "nm";
  for (std::size_t i = 0; i < info.channels.size() && !isColor(); ++i) {
    SourceChannel& channel = info.channels[i];
    if (info.channels.size() > 1) channel.name = fmt::format("channel \\{} \"µ\"", i);
    channel.color = {{1, 2, static_cast<std::uint8_t>(250 + i)}};
    channel.window = {{0.5, 100.25 + static_cast<double>(i)}};
  }
  build(source);
  const ExportReport report = exportTo("out.zarr", ExportFormat::zarr);
  EXPECT_THAT(report.notes, IsEmpty());
  std::uint64_t bytes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ / "out.zarr")) {
    EXPECT_EQ(entry.path().filename().string().find("partial"), std::string::npos);
    if (entry.is_regular_file()) bytes += entry.file_size();
  }
  EXPECT_EQ(report.bytes, bytes);
  expectSame("out.zarr", report);
}

// Each level is a level of the group, in the place of the volume's, whatever the type.
TEST_P(FormatShapes, ZarrHasTheCoarserLevels) {
  MemorySource source = random("v", "v");
  source.change().world_from_index[3] = {5, 6, 7, 1};
  build(source);
  exportTo("out.zarr", ExportFormat::zarr);
  const VolumeFile file(folder_ / "v.bwv");
  const VolumeInfo& info = file.info();
  for (int level = 0; level < static_cast<int>(info.levels.size()); ++level) {
    ImportOptions options;
    options.level = level;
    if (isColor()) options.channels = ChannelRule::color;
    const auto read = openSource({folder_ / "out.zarr"}, options);
    const glm::ivec3 dims = info.level(level, Form::values).dims;
    ASSERT_EQ(read->info().dims, dims);
    const glm::dvec3 far(read->info().world_from_index * glm::dvec4(glm::dvec3(1), 1.0));
    EXPECT_LT(glm::length(far - (glm::dvec3(5, 6, 7) + std::exp2(level))), 1e-12);
    const std::size_t width = voxelBytes(info.type);
    const std::size_t slice = static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * width;
    std::vector<std::byte> rows(slice * info.channels.size());
    for (int z = 0; z < dims.z; ++z) {
      read->readRows(z, 0, dims.y, rows);
      for (std::size_t i = 0; i < info.channels.size(); ++i) {
        const DenseLevel dense = readDense(file, level, static_cast<int>(i));
        const std::byte* expected = &dense.voxels[static_cast<std::size_t>(z) * slice];
        for (std::size_t at = 0; at < slice; at += width) {
          if (!dense.stored[(static_cast<std::size_t>(z) * slice + at) / width]) continue;
          ASSERT_EQ(std::memcmp(&rows[i * slice + at], expected + at, width), 0) << level << " " << z << " " << at;
        }
      }
    }
  }
}

TEST_P(FormatShapes, NpyKeepsVoxelsBehindTheirShape) {
  MemorySource source = random("out.npy", "npy");
  source.change().world_from_index =
      glm::dmat4(glm::dvec4(0.7, 0, 0, 0), glm::dvec4(0, 0.1, 0, 0), glm::dvec4(0, 0, 3, 0), glm::dvec4(0, 0, 0, 1));
  build(source);
  const ExportReport report = exportTo("out.npy", ExportFormat::npy);
  EXPECT_THAT(report.notes, IsEmpty());
  EXPECT_THAT(readBytes(folder_ / "out.npy").substr(0, 128), HasSubstr("'fortran_order': False, 'shape': ("));
  expectSame("out.npy", report);
}

TEST_P(FormatShapes, PngKeepsVoxelsOfOneChannelOfBytes) {
  const Shape& shape = GetParam();
  MemorySource source = random("out", "png");
  build(source);
  if (shape.type == VoxelType::f32 || shape.channels > 1) {
    EXPECT_THAT(exportRefusal(folder_ / "v.bwv", folder_ / "out", {.format = ExportFormat::png}), HasSubstr("PNG has"));
    EXPECT_EQ(namesIn(folder_.path), std::set<std::string>{"v.bwv"});
    return;
  }
  const ExportReport report = exportTo("out", ExportFormat::png);
  EXPECT_THAT(report.notes, IsEmpty());
  EXPECT_EQ(namesIn(folder_ / "out").size(), static_cast<std::size_t>(shape.dims.z));
  expectSame("out", report);
}

// A box of a level lies where it lay, in every format that has places.
TEST_P(FormatShapes, ABoxOfALevelKeepsItsPlace) {
  MemorySource source = random("v", "v");
  source.change().world_from_index =
      glm::dmat4(glm::dvec4(0.5, 0, 0, 0), glm::dvec4(0, 0.25, 0, 0), glm::dvec4(0, 0, 3, 0), glm::dvec4(-8, 2, 30, 1));
  build(source);
  const VolumeFile file(folder_ / "v.bwv");
  const int level = file.info().levels.size() > 1 ? 1 : 0;
  const glm::ivec3 dims = file.info().level(level, Form::values).dims;
  const VoxelBox box{dims / 3, glm::max(dims / 3 + 1, dims - 1)};
  const glm::dvec3 corner = glm::dvec3(-8, 2, 30) + glm::dvec3(box.begin) * std::exp2(level) * glm::dvec3(0.5, 0.25, 3);
  for (const auto& [name, format] :
       {std::pair{"a.nii", ExportFormat::nifti}, {"a.tif", ExportFormat::tiff}, {"a.zarr", ExportFormat::zarr}}) {
    exportVolume(file, folder_.path / name, {.format = format, .level = level, .box = box});
    const auto read = openSource({folder_.path / name}, {});
    EXPECT_EQ(read->info().dims, box.dims()) << name;
    EXPECT_LT(glm::length(glm::dvec3(read->info().world_from_index[3]) - corner), 1e-6) << name;
    EXPECT_LT(std::fabs(read->info().world_from_index[0][0] - 0.5 * std::exp2(level)), 1e-6) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(All, FormatShapes, testing::ValuesIn(kShapes), [](const auto& instance) {
  return fmt::format("{}_{}x{}", instance.index, instance.param.channels, voxelTypeName(instance.param.type));
});

// Whatever is held at once, the rows are those of the box.
TEST(RowReader, GivesTheSameRowsInAnyMemory) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u16, {37, 41, 53}, 8, false, 2);
  BuildOptions options;
  options.subblock_side = 4;
  options.block_side = 3;
  buildVolume(source, folder / "v.bwv", options);
  const VolumeFile file(folder / "v.bwv");
  const ExportJob job{.file = file, .box = {{3, 5, 7}, {36, 40, 50}}, .channels = {1, 0}};
  const glm::ivec3 dims = job.box.dims();
  const std::size_t row_bytes = static_cast<std::size_t>(dims.x) * 2;
  BoxReader whole(file, 0);
  for (const std::size_t memory : {0u, 1000u, 5000u, 40000u, 1u << 20}) {
    RowReader reader(job, memory);
    for (std::size_t channel = 0; channel < 2; ++channel) {
      std::vector<std::byte> expected(job.box.voxels() * 2);
      whole.read(job.channels[channel], job.box, expected);
      std::vector<std::byte> got;
      for (int z = 0; z < dims.z; ++z) {
        for (int y = 0; y < dims.y;) {
          const int count = std::min(reader.rowsAt(y), 1 + (y * 7 + z) % 5);
          const auto rows = reader.rows(channel, z, y, count);
          ASSERT_EQ(rows.size(), static_cast<std::size_t>(count) * row_bytes);
          got.insert(got.end(), rows.begin(), rows.end());
          y += count;
        }
      }
      EXPECT_TRUE(got == expected) << memory << " " << channel;
    }
  }
}

// What is sent piece by piece is what is written.
TEST(ExportStream, HasTheBytesOfTheFile) {
  const ScratchFolder folder;
  for (const Shape& shape : kShapes) {
    MemorySource source = randomSource(shape.type, shape.dims, 5, shape.threshold < 0, shape.channels);
    source.change().world_from_index[3] = {1, 2, 3, 1};
    buildShape(shape, source, folder / "v.bwv");
    const VolumeFile file(folder / "v.bwv");
    for (const ExportFormat format : {ExportFormat::nrrd, ExportFormat::npy, ExportFormat::raw}) {
      const VoxelBox box{shape.dims / 3, shape.dims};
      const ExportOptions options{.format = format, .box = box};
      exportVolume(file, folder / "a", options);
      ExportStream stream(file, options);
      std::string bytes;
      for (auto piece = stream.next(); !piece.empty(); piece = stream.next()) {
        bytes.append(reinterpret_cast<const char*>(piece.data()), piece.size());
      }
      EXPECT_EQ(bytes.size(), stream.bytes());
      EXPECT_TRUE(bytes == readBytes(folder / "a"));
    }
    EXPECT_THROW(ExportStream(file, {.format = ExportFormat::tiff}), ExportError);
    EXPECT_THROW(ExportStream(file, {.level = 17}), ExportError);
  }
}

// The same places, by the directions that NIfTI has.
TEST(ExportNifti, TurnsTheAxesOfPatientsToItsOwn) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {4, 5, 6}, 1);
  source.change().world_from_index =
      glm::dmat4(glm::dvec4(0.5, 0, 0, 0), glm::dvec4(0, 0, 2, 0), glm::dvec4(0, -4, 0, 0), glm::dvec4(1, 2, 3, 1));
  source.change().space = "left-posterior-superior";
  source.change().length_unit = "nm";
  buildVolume(source, folder / "v.bwv", {});
  const ExportReport report =
      exportVolume(VolumeFile(folder / "v.bwv"), folder / "a.nii", {.format = ExportFormat::nifti});
  EXPECT_THAT(report.notes, testing::UnorderedElementsAre(HasSubstr("in um, not in nm"),
                                                          HasSubstr("right-anterior-superior, not left-posterior"),
                                                          HasSubstr("rounded by")));
  const auto read = openSource({folder / "a.nii"}, {});
  const glm::dmat4 expected(glm::dvec4(-0.5e-3, 0, 0, 0), glm::dvec4(0, 0, 2e-3, 0), glm::dvec4(0, 4e-3, 0, 0),
                            glm::dvec4(-1e-3, -2e-3, 3e-3, 1));
  for (int i = 0; i < 4; ++i) EXPECT_LT(glm::length(read->info().world_from_index[i] - expected[i]), 1e-9) << i;
  EXPECT_EQ(read->info().length_unit, "um");
}

// The empty value is that of the map that was rounded, so what was empty is.
TEST(ExportNifti, SaysHowItRoundsTheMapOfValues) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u16, {30, 20, 10}, 1);
  source.change().channels[0].value_scale = 0.1;
  source.change().channels[0].value_offset = 1e-3;
  const Shape shape{VoxelType::u16, 1, {30, 20, 10}, 8, 31234};
  buildShape(shape, source, folder / "v.bwv");
  const VolumeFile file(folder / "v.bwv");
  const ExportReport report = exportVolume(file, folder / "a.nii", {.format = ExportFormat::nifti});
  EXPECT_THAT(report.notes, ElementsAre(HasSubstr("data = 0.001 + 0.1 * value is rounded to 0.00")));
  importAgain(folder / "a.nii", report, folder / "w.bwv");
  const VolumeFile again(folder / "w.bwv");
  EXPECT_EQ(again.info().channels[0].nonempty_voxels, file.info().channels[0].nonempty_voxels);
  EXPECT_EQ(readDense(again, 0).voxels, readDense(file, 0).voxels);
}

TEST(ExportZarr, LabelsKeepNamesAndColors) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {30, 30, 30}, 2);
  source.change().name = "a.zarr";
  source.change().format = "zarr";
  source.change().channels[0].is_labels = true;
  source.change().channels[0].labels = {{1, "bone", Color{255, 250, 240}}, {2, "", Color{1, 2, 3}}, {7, "heart", {}}};
  source.change().channels[0].color = Color{255, 255, 255};
  BuildOptions options;
  options.block_side = 3;
  options.values = ValuesRule::guess;
  buildVolume(source, folder / "v.bwv", options);
  const VolumeFile file(folder / "v.bwv");
  const ExportReport report = exportVolume(file, folder / "a.zarr", {.format = ExportFormat::zarr});
  EXPECT_THAT(report.notes, IsEmpty());
  importAgain(folder / "a.zarr", report, folder / "w.bwv");
  const VolumeFile again(folder / "w.bwv");
  const ChannelInfo& channel = again.info().channels[0];
  EXPECT_EQ(channel.values, ChannelValues::labels);
  ASSERT_EQ(channel.labels.size(), 3u);
  EXPECT_EQ(channel.labels[0].name, "bone");
  EXPECT_EQ(channel.labels[1].color, (Color{1, 2, 3}));
  EXPECT_EQ(channel.labels[2].name, "heart");
  EXPECT_EQ(readDense(again, 0).voxels, readDense(file, 0).voxels);
}

TEST(ExportFormats, AreFoundByName) {
  EXPECT_EQ(exportFormatOf("a/b.NII.gz"), ExportFormat::nifti);
  EXPECT_EQ(exportFormatOf("b.tiff"), ExportFormat::tiff);
  EXPECT_EQ(exportFormatOf("b.zarr/"), ExportFormat::zarr);
  EXPECT_EQ(exportFormatOf("b.gz"), std::nullopt);
  EXPECT_EQ(exportFormatOf(""), std::nullopt);
  for (const std::string& name : exportFormatNames()) EXPECT_TRUE(exportFormat(name)) << name;
  EXPECT_EQ(exportFormat("bmp"), std::nullopt);
}

TEST(ExportFormats, TakeNeitherTheMemoryNorTheTimeOfTheDenseVolume) {
  const ScratchFolder folder;
  LongSource source(100);
  buildVolume(source, folder / "v.bwv", {});
  const VolumeFile file(folder / "v.bwv");
  // A side of more than 32,767 voxels is NIfTI-2's.
  for (const auto& [name, format] : {std::pair{"a.nii", ExportFormat::nifti}, {"a.zarr", ExportFormat::zarr}}) {
    const std::uint64_t before = allocations().bytes;
    forgetMost();
    exportVolume(file, folder / name, {.format = format});
    EXPECT_LT(allocations().most, before + (std::uint64_t{96} << 20)) << name;
    const auto read = openSource({folder / name}, {});
    EXPECT_EQ(read->info().dims, source.info().dims) << name;
    std::vector<std::byte> row(160000);
    read->readRows(0, 0, 1, row);
    std::array<float, 2> first{};
    std::memcpy(first.data(), row.data(), sizeof first);
    EXPECT_EQ(first[0], 1.0f) << name;
    EXPECT_EQ(first[1], 0.0f) << name;
  }
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "a.zarr")) {
    files += entry.path().string().find("/0/c/") != std::string::npos && entry.is_regular_file() ? 1u : 0u;
  }
  EXPECT_EQ(files, 1u) << "blank chunks are not there";
}

// 4.8 GB behind one directory, as ImageJ has it; none of them on the disk.
TEST(ExportTiff, GoesBeyondFourGigabytes) {
  const ScratchFolder folder;
  LongSource source(300);
  buildVolume(source, folder / "v.bwv", {});
  const ExportReport report =
      exportVolume(VolumeFile(folder / "v.bwv"), folder / "a.tif", {.format = ExportFormat::tiff});
  EXPECT_GT(report.bytes, std::uint64_t{4'800'000'000});
  EXPECT_EQ(std::filesystem::file_size(folder / "a.tif"), report.bytes);
  const auto read = openSource({folder / "a.tif"}, {});
  EXPECT_EQ(read->info().dims, source.info().dims);
  std::vector<std::byte> row(160000);
  read->readRows(0, 0, 1, row);
  float first = 0;
  std::memcpy(&first, row.data(), sizeof first);
  EXPECT_EQ(first, 1.0f);
}

}  // namespace
}  // namespace blockwalk::volume_test
