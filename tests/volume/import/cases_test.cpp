// SPDX-License-Identifier: Apache-2.0
// Small files of what users of other programs met, with the figures that other readers give for them.
#include <cmath>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::optional<std::filesystem::path> caseFile(const std::string& name) {
  const char* named = std::getenv("BLOCKWALK_CASES");
  const std::filesystem::path folder = named != nullptr ? named : BLOCKWALK_SOURCE_DIR "/../shared/cases";
  if (!std::filesystem::exists(folder / name)) return std::nullopt;
  return folder / name;
}

struct Case {
  const char* file;
  glm::ivec3 dims;
  double sum;    // of finite values, of one channel
  double value;  // of voxel 1, 2, 3
  double most;
  glm::dvec3 spacing{1};
  const char* unit = "";
  const char* note = nullptr;  // none where it is nullptr
};

void PrintTo(const Case& one, std::ostream* out) { *out << one.file; }

const Case kCases[] = {
    {"meta_list/x.mhd", {7, 6, 5}, 4822535, 0, 59272},
    {"meta_list/y.mhd", {7, 6, 5}, 4822535, 0, 59272},
    {"meta_percent_in_name/x.mhd", {7, 6, 5}, 15251, 0, 199},
    {"meta_uchar_array/x.mha", {7, 6, 5}, 14078, 100, 198},
    {"nrrd_4d_last_1/x.nrrd", {7, 6, 5}, 15251, 0, 199, {0.5, 0.5, 2}},
    {"nrrd_bzip2/x.nrrd", {7, 6, 5}, 4822535, 0, 59272},
    {"nrrd_list/x.nhdr", {7, 6, 5}, 15251, 0, 199},
    {"nrrd_list/y.nhdr", {7, 6, 5}, 15251, 0, 199},
    {"nrrd_nhdr_parent_path/up.nhdr", {7, 6, 5}, 15251, 0, 199},
    {"nrrd_trailing_bytes/x.nrrd", {7, 6, 5}, 15251, 0, 199, glm::dvec3(1), "", "1 bytes behind"},
    {"nrrd_trailing_bytes/t.nhdr", {7, 6, 5}, 125573, 1284, 2874, glm::dvec3(0.02), "", "77 bytes behind"},
    {"tiff_float16/x.tif", {64, 48, 5}, 103500, 79, 119},
    {"tiff_image_depth/v.tif", {64, 48, 5}, 323187200, 27361, 59991},
    {"tiff_imagej_calibration/x.tif", {7, 6, 5}, 4822535, 0, 59272, {0.25, 0.25, 2}, "um"},
    {"tiff_imagej_one_ifd/x.tif", {64, 48, 5}, 323187200, 27361, 59991, {1, 1, 2}, "um"},
    {"tiff_imagej_signed16/x.tif", {32, 24, 5}, 2822452, 1325, 2999, {1, 1, 2}, "mm"},
    {"tiff_ome_ifd_order/r.ome.tif", {32, 24, 5}, 77100658, 0, 59957, {0.2, 0.2, 1}, "um"},
    {"tiff_orientation_4/x.tif", {64, 48, 5}, 323187200, 21952, 59991},
};

double valueAt(const SourceInfo& info, const std::string& voxels, std::size_t index) {
  const auto* voxel = reinterpret_cast<const std::byte*>(&voxels[index * voxelBytes(info.type)]);
  return info.channels[0].value_offset +
         info.channels[0].value_scale * static_cast<double>(storedDensity(info.type, voxel));
}

class ImportCases : public testing::TestWithParam<Case> {};

TEST_P(ImportCases, AreAsOtherReadersHaveThem) {
  const Case& expected = GetParam();
  const auto file = caseFile(expected.file);
  if (!file) GTEST_SKIP() << "no such file: set BLOCKWALK_CASES to the folder of cases";
  ImportOptions options;
  options.channels = ChannelRule::fields;
  const auto source = openSource({*file}, options);
  const SourceInfo& info = source->info();
  ASSERT_EQ(info.dims, expected.dims);
  const std::string voxels = readAll(*source);
  double sum = 0;
  double most = -HUGE_VAL;
  for (std::size_t i = 0; i < voxels.size() / voxelBytes(info.type) / info.channels.size(); ++i) {
    const double value = valueAt(info, voxels, i);
    if (!std::isfinite(value)) continue;
    sum += value;
    most = std::max(most, value);
  }
  EXPECT_EQ(sum, expected.sum);
  EXPECT_EQ(most, expected.most);
  const auto index = static_cast<std::size_t>((3 * info.dims.y + 2) * info.dims.x + 1);
  EXPECT_EQ(valueAt(info, voxels, index), expected.value);
  const glm::dmat4& world = info.world_from_index;
  EXPECT_EQ(glm::dvec3(glm::length(world[0]), glm::length(world[1]), glm::length(world[2])), expected.spacing);
  EXPECT_EQ(info.length_unit, expected.unit);
  if (expected.note == nullptr) {
    EXPECT_THAT(info.notes, IsEmpty());
  } else {
    EXPECT_THAT(info.notes, ElementsAre(HasSubstr(expected.note)));
  }
}

INSTANTIATE_TEST_SUITE_P(Files, ImportCases, testing::ValuesIn(kCases), [](const auto& instance) {
  std::string name = instance.param.file;
  for (char& letter : name) {
    if (std::isalnum(static_cast<unsigned char>(letter)) == 0) letter = '_';
  }
  return name;
});

TEST(ImportCasesMore, TooFewFilesOfAListAreRefused) {
  const auto file = caseFile("meta_list/z.mhd");
  if (!file) GTEST_SKIP() << "no such file: set BLOCKWALK_CASES to the folder of cases";
  EXPECT_THAT(refusal({*file}), HasSubstr("3 files are listed, DimSize needs 5"));
}

TEST(ImportCasesMore, APlusInFrontOfANumberIsRead) {
  const auto nrrd = caseFile("text_plus_sign/x.nrrd");
  if (!nrrd) GTEST_SKIP() << "no such file: set BLOCKWALK_CASES to the folder of cases";
  const std::string values = importAll(*nrrd);
  EXPECT_EQ(values.substr(0, 12), bytesOf<float>({1.5f, 1000, -2}));
  EXPECT_EQ(values.substr(12), bytesOf<float>({HUGE_VALF}));
  EXPECT_EQ(importAll(*caseFile("text_plus_sign/y.mha")), bytesOf<float>({1.5f, -2}));
}

// The same object, written for a right-handed and for a left-handed space, lies at the same place.
TEST(ImportCasesMore, HandednessOfSpaceIsKept) {
  const auto left = caseFile("nrrd_space_las/las.nrrd");
  if (!left) GTEST_SKIP() << "no such file: set BLOCKWALK_CASES to the folder of cases";
  const auto las = openSource({*left}, {});
  const auto ras = openSource({*caseFile("nrrd_space_las/ras.nrrd")}, {});
  EXPECT_EQ(las->info().space, "right-anterior-superior");
  EXPECT_EQ(ras->info().space, "right-anterior-superior");
  const std::string voxels_las = readAll(*las);
  const std::string voxels_ras = readAll(*ras);
  const glm::dmat4 ras_index = glm::inverse(ras->info().world_from_index) * las->info().world_from_index;
  const glm::ivec3 dims = las->info().dims;
  int seen = 0;
  for (int z = 0; z < dims.z; ++z) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x) {
        const char value = voxels_las[static_cast<std::size_t>((z * dims.y + y) * dims.x + x)];
        if (value == 0) continue;
        ++seen;
        const glm::ivec3 at(glm::floor(glm::dvec3(ras_index * glm::dvec4(x + 0.5, y + 0.5, z + 0.5, 1))));
        const glm::ivec3 other = ras->info().dims;
        ASSERT_TRUE(glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) && glm::all(glm::lessThan(at, other)));
        ASSERT_EQ(voxels_ras[static_cast<std::size_t>((at.z * other.y + at.y) * other.x + at.x)], value);
      }
    }
  }
  EXPECT_GT(seen, 100);
}

TEST(ImportCasesMore, AMissingSliceIsTold) {
  const auto folder = caseFile("stack_gap");
  if (!folder) GTEST_SKIP() << "no such file: set BLOCKWALK_CASES to the folder of cases";
  const auto source = openSource({*folder}, {});
  EXPECT_EQ(source->info().dims.z, 11);
  EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("number 7;")));
}

TEST(ImportCasesMore, BlueIsAsDenseAsGreen) {
  const auto file = caseFile("rgb_blue/rgb3.nrrd");
  if (!file) GTEST_SKIP() << "no such file: set BLOCKWALK_CASES to the folder of cases";
  const std::string voxels = importAll(*file);
  std::array<int, 3> most{};
  for (std::size_t i = 0; i < voxels.size(); i += 4) {
    for (std::size_t c = 0; c < 3; ++c) {
      const bool is_pure = voxels[i + (c + 1) % 3] == 0 && voxels[i + (c + 2) % 3] == 0;
      if (is_pure) most[c] = std::max(most[c], static_cast<int>(static_cast<unsigned char>(voxels[i + 3])));
    }
  }
  EXPECT_GE(2 * most[2], most[1]);
  EXPECT_GE(2 * most[0], most[1]);
  EXPECT_GT(most[2], 200);
}

}  // namespace
}  // namespace blockwalk
