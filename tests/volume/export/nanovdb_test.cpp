// SPDX-License-Identifier: Apache-2.0
// What a volume is as NanoVDB: for our own reader, and for NanoVDB's.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/volume/export/export_scratch.h"
#include "volume/export/box_reader.h"

#ifdef BLOCKWALK_NANOVDB
#include <nanovdb/util/GridValidator.h>
#include <nanovdb/util/IO.h>
#endif

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

// All data values of a channel of level 0; of colours the stored bits.
std::vector<double> valuesOf(const VolumeFile& file, int channel) {
  const VolumeInfo& info = file.info();
  const std::size_t bytes = voxelBytes(info.type);
  const VoxelBox box{.begin = glm::ivec3(0), .end = info.dims};
  std::vector<std::byte> voxels(box.voxels() * bytes);
  BoxReader(file, 0).read(channel, box, voxels);
  std::vector<double> values;
  for (std::size_t i = 0; i < voxels.size(); i += bytes) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &voxels[i], bytes);
    const ChannelInfo& of = info.channels[static_cast<std::size_t>(channel)];
    const float density = storedDensity(info.type, &voxels[i]);
    const bool is_empty = isEmptyDensity(density, of.empty_threshold);
    values.push_back(is_empty ? HUGE_VAL : info.type == VoxelType::rgba8 ? bits : of.dataFromStored(density));
  }
  return values;
}

// What is not empty in one is it in the other, with its value, at its place in the world.
void expectSameVoxels(const VolumeFile& one, const VolumeFile& other) {
  ASSERT_EQ(one.info().channels.size(), other.info().channels.size());
  const glm::dmat4 between = glm::inverse(other.info().world_from_index) * one.info().world_from_index;
  const glm::dvec3 offset(between * glm::dvec4(0, 0, 0, 1));
  const glm::ivec3 apart(glm::round(offset));
  EXPECT_LT(glm::length(offset - glm::dvec3(apart)), 1e-6);
  const glm::ivec3 dims = one.info().dims;
  const glm::ivec3 inner = other.info().dims;
  for (int channel = 0; channel < static_cast<int>(one.info().channels.size()); ++channel) {
    const std::vector<double> ours = valuesOf(one, channel);
    const std::vector<double> theirs = valuesOf(other, channel);
    std::size_t wrong = 0;
    std::size_t found = 0;
    for (std::size_t i = 0; i < ours.size(); ++i) {
      const auto at = static_cast<int>(i);
      const glm::ivec3 place = glm::ivec3(at % dims.x, at / dims.x % dims.y, at / dims.x / dims.y) + apart;
      const bool is_inside =
          glm::all(glm::greaterThanEqual(place, glm::ivec3(0))) && glm::all(glm::lessThan(place, inner));
      const double got =
          is_inside ? theirs[static_cast<std::size_t>((place.z * inner.y + place.y) * inner.x + place.x)] : HUGE_VAL;
      if (got != ours[i]) ++wrong;
      if (ours[i] != HUGE_VAL) ++found;
    }
    EXPECT_EQ(wrong, 0u) << channel;
    EXPECT_EQ(other.info().channels[static_cast<std::size_t>(channel)].nonempty_voxels, found);
  }
}

struct NanoShape {
  VoxelType type;
  std::size_t channels;
  glm::ivec3 dims;
  int subblock_side;
  double threshold;
};

class NanoVdbExport : public testing::Test {
 protected:
  void build(const NanoShape& shape) {
    MemorySource source = randomSource(shape.type, shape.dims, 5, shape.threshold < 0, shape.channels);
    SourceInfo& info = source.change();
    info.world_from_index = glm::dmat4(glm::dvec4(0.1, 0.7, 0, 0), glm::dvec4(-0.3, 0.2, 1e-3, 0),
                                       glm::dvec4(1.0 / 3, 0, -2.9, 0), glm::dvec4(-123.456, 1e-7, 1e3 / 7, 1));
    for (std::size_t i = 0; i < shape.channels && shape.channels > 1; ++i)
      info.channels[i].name = fmt::format("n{}", i);
    BuildOptions options;
    options.subblock_side = shape.subblock_side;
    options.block_side = 3;
    for (std::size_t i = 0; i < shape.channels; ++i) {
      options.empty_thresholds.push_back(info.channels[i].value_offset +
                                         info.channels[i].value_scale * shape.threshold);
    }
    buildVolume(source, folder_ / "v.bwv", options);
  }
  ExportReport write(const ExportOptions& more = {}) {
    ExportOptions options = more;
    options.format = ExportFormat::nanovdb;
    return exportVolume(VolumeFile(folder_ / "v.bwv"), folder_ / "v.nvdb", options);
  }

  ScratchFolder folder_;
};

TEST_F(NanoVdbExport, ImportOfItIsTheVolume) {
  for (const NanoShape& shape :
       {NanoShape{VoxelType::u8, 1, {61, 47, 33}, 8, 0}, NanoShape{VoxelType::u8, 4, {29, 53, 7}, 4, 100},
        NanoShape{VoxelType::u16, 3, {140, 25, 26}, 8, 20000}, NanoShape{VoxelType::f32, 1, {40, 31, 59}, 8, -90},
        NanoShape{VoxelType::f32, 2, {97, 3, 13}, 4, 0.125}, NanoShape{VoxelType::rgba8, 1, {23, 64, 25}, 8, 99}}) {
    build(shape);
    const ExportReport report = write();
    EXPECT_EQ(report.bytes, std::filesystem::file_size(folder_ / "v.nvdb"));
    importAgain(folder_ / "v.nvdb", report, folder_ / "w.bwv", shape.subblock_side);
    const VolumeFile one(folder_ / "v.bwv");
    const VolumeFile other(folder_ / "w.bwv");
    EXPECT_EQ(other.info().metadata.source_kind, "nanovdb");
    EXPECT_EQ(other.info().channels.back().name, shape.channels > 1 ? fmt::format("n{}", shape.channels - 1) : "");
    expectSameVoxels(one, other);
  }
}

TEST_F(NanoVdbExport, ABoxOfALevelKeepsItsPlace) {
  build({VoxelType::u8, 1, {91, 77, 53}, 8, 0});
  ExportOptions options;
  options.box = VoxelBox{.begin = {5, 11, 3}, .end = {80, 60, 41}};
  importAgain(folder_ / "v.nvdb", write(options), folder_ / "w.bwv");
  exportVolume(VolumeFile(folder_ / "v.bwv"), folder_ / "v.nrrd", [&] {
    options.format = ExportFormat::nrrd;
    return options;
  }());
  buildVolume(*openSource({folder_ / "v.nrrd"}, {}), folder_ / "n.bwv", {.empty_thresholds = {0}});
  expectSameVoxels(VolumeFile(folder_ / "n.bwv"), VolumeFile(folder_ / "w.bwv"));
}

TEST_F(NanoVdbExport, NothingIsNoGrid) {
  build({VoxelType::u8, 1, {20, 20, 20}, 8, 255});
  ExportOptions options;
  options.format = ExportFormat::nanovdb;
  EXPECT_THAT(exportRefusal(folder_ / "v.bwv", folder_ / "v.nvdb", options), HasSubstr("all of its voxels are empty"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "v.nvdb"));
}

#ifdef BLOCKWALK_NANOVDB
// The headers' own checks, and each voxel by their accessor.
TEST_F(NanoVdbExport, NanoVdbReadsIt) {
  build({VoxelType::u16, 2, {150, 40, 30}, 8, 20000});
  write();
  const VolumeFile file(folder_ / "v.bwv");
  const auto handles = nanovdb::io::readGrids((folder_ / "v.nvdb").string());
  ASSERT_EQ(handles.size(), 2u);
  for (int channel = 0; channel < 2; ++channel) {
    const auto* grid = handles[static_cast<std::size_t>(channel)].grid<float>();
    ASSERT_NE(grid, nullptr);
    EXPECT_TRUE(nanovdb::isValid(*grid, true, true));
    EXPECT_EQ(grid->gridName(), fmt::format("n{}", channel));
    EXPECT_EQ(grid->activeVoxelCount(), file.info().channels[static_cast<std::size_t>(channel)].nonempty_voxels);
    const auto access = grid->getAccessor();
    const std::vector<double> values = valuesOf(file, channel);
    std::size_t i = 0;
    std::size_t wrong = 0;
    for (int z = 0; z < 30; ++z) {
      for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 150; ++x, ++i) {
          const nanovdb::Coord at(x, y, z);
          if (access.isActive(at) != (values[i] != HUGE_VAL)) ++wrong;
          if (access.isActive(at) && access.getValue(at) != static_cast<float>(values[i])) ++wrong;
        }
      }
    }
    EXPECT_EQ(wrong, 0u);
    const auto centre = grid->indexToWorld(nanovdb::Vec3d(3, 4, 5));
    const glm::dvec4 ours = file.info().world_from_index * glm::dvec4(3.5, 4.5, 5.5, 1);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(centre[axis], ours[axis], 1e-9);
    EXPECT_EQ(grid->tree().root().minimum(), static_cast<float>(std::ranges::min(values)));
  }
  build({VoxelType::rgba8, 1, {23, 64, 25}, 8, 99});
  write();
  const auto color = nanovdb::io::readGrid((folder_ / "v.nvdb").string());
  ASSERT_NE(color.grid<nanovdb::Rgba8>(), nullptr);
  EXPECT_TRUE(nanovdb::isValid(*color.grid<nanovdb::Rgba8>(), true, true));
}
#endif

}  // namespace
}  // namespace blockwalk::volume_test
