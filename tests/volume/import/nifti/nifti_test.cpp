// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <functional>
#include <random>

#include "tests/volume/import/broken.h"
#include "tests/volume/import/nifti/nifti_writer.h"
#include "volume/build/builder.h"
#include "volume/file/file.h"

namespace blockwalk {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::array<double, 12> kPlain{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

TEST(ImportNifti, ReadsEveryTypeInBothVersionsAndByteOrders) {
  struct Type {
    std::int16_t code;
    std::uint8_t bytes;
    VoxelType type;
    std::string values;
    std::string stored;
  };
  const std::string bytes = bytesOf<std::uint8_t>({1, 2, 255});
  const std::string floats = bytesOf<float>({1, 2, 255});
  const Type types[] = {
      {2, 1, VoxelType::u8, bytes, bytes},
      {256, 1, VoxelType::u8, bytesOf<std::int8_t>({-128, 0, 5}), bytesOf<std::uint8_t>({0, 128, 133})},
      {512, 2, VoxelType::u16, bytesOf<std::uint16_t>({1, 2, 60000}), bytesOf<std::uint16_t>({1, 2, 60000})},
      {4, 2, VoxelType::u16, bytesOf<std::int16_t>({-1, 0, 1}), bytesOf<std::uint16_t>({32767, 32768, 32769})},
      {768, 4, VoxelType::f32, bytesOf<std::uint32_t>({1, 2, 255}), floats},
      {8, 4, VoxelType::f32, bytesOf<std::int32_t>({1, 2, 255}), floats},
      {1280, 8, VoxelType::f32, bytesOf<std::uint64_t>({1, 2, 255}), floats},
      {1024, 8, VoxelType::f32, bytesOf<std::int64_t>({1, 2, 255}), floats},
      {16, 4, VoxelType::f32, floats, floats},
      {64, 8, VoxelType::f32, bytesOf<double>({1, 2, 255}), floats}};
  const Scratch scratch;
  for (const bool wide : {false, true}) {
    for (const bool swap : {false, true}) {
      for (const Type& type : types) {
        const std::string header = NiftiFile(wide, swap).type(type.code).dims({3, 1, 1}).sform(1, kPlain).bytes();
        const std::string voxels = swap ? swapped(type.values, type.bytes) : type.values;
        const auto source = openSource({scratch.write("a.nii", header + voxels)}, {});
        EXPECT_EQ(source->info().type, type.type) << type.code;
        EXPECT_EQ(readAll(*source), type.stored) << type.code << wide << swap;
        EXPECT_EQ(importAll(scratch.write("a.nii.gz", gzipped(header + voxels))), type.stored);
      }
    }
  }
  const std::string colors = bytesOf<std::uint8_t>({1, 2, 3, 4, 5, 6, 7, 8});
  const auto rgba = NiftiFile().type(2304).dims({2}).sform(1, kPlain).bytes() + colors;
  EXPECT_EQ(importAll(scratch.write("c", rgba)), colors);
  const auto rgb = NiftiFile().type(128).dims({2}).sform(1, kPlain).bytes() + colors.substr(0, 6);
  EXPECT_EQ(importAll(scratch.write("d", rgb)), bytesOf<std::uint8_t>({1, 2, 3, 3, 4, 5, 6, 6}));
}

TEST(ImportNifti, TakesTheAffineElseTheRotationElseSizes) {
  const Scratch scratch;
  for (const bool wide : {false, true}) {
    const auto infoOf = [&](const NiftiFile& file) {
      return openSource({scratch.write("a.nii", file.bytes() + std::string(24, 'v'))}, {})->info();
    };
    const std::array<double, 12> oblique{0, -2, 0, 10, 1.5, 0, 0, 20, 0, 0, 4, 30};
    NiftiFile both(wide);
    both.dims({2, 3, 4}).sform(2, oblique).qform(1, 1, {0, 0, 0, 7, 8, 9}).units(2);
    const SourceInfo affine = infoOf(both);
    EXPECT_EQ(worldOf(affine, {0.5, 0.5, 0.5}), glm::dvec3(10, 20, 30));
    EXPECT_EQ(worldOf(affine, {1.5, 0.5, 0.5}), glm::dvec3(10, 21.5, 30));
    EXPECT_EQ(worldOf(affine, {0.5, 1.5, 0.5}), glm::dvec3(8, 20, 30));
    EXPECT_EQ(affine.space, "right-anterior-superior");
    EXPECT_EQ(affine.length_unit, "mm");
    EXPECT_THAT(affine.notes, IsEmpty());
    // A quarter turn about z; the third axis is turned round.
    NiftiFile turned(wide);
    const double half = std::sqrt(0.5);
    turned.dims({2, 3, 4}).qform(1, -1, {0, 0, half, 7, 8, 9}).pixdim(1, 2).pixdim(2, 3).pixdim(3, 4).units(3);
    const SourceInfo rotation = infoOf(turned);
    const auto near = [](glm::dvec3 a, glm::dvec3 b) { return glm::length(a - b) < 1e-5; };
    EXPECT_TRUE(near(worldOf(rotation, {0.5, 0.5, 0.5}), {7, 8, 9}));
    EXPECT_TRUE(near(worldOf(rotation, {1.5, 0.5, 0.5}), {7, 10, 9}));
    EXPECT_TRUE(near(worldOf(rotation, {0.5, 1.5, 0.5}), {4, 8, 9}));
    EXPECT_TRUE(near(worldOf(rotation, {0.5, 0.5, 1.5}), {7, 8, 5}));
    EXPECT_EQ(rotation.length_unit, "um");
    NiftiFile sizes(wide);
    sizes.dims({2, 3, 4}).pixdim(1, 2).pixdim(2, 3).pixdim(3, 4).units(0);
    const SourceInfo plain = infoOf(sizes);
    EXPECT_EQ(worldOf(plain, {0.5, 0.5, 0.5}), glm::dvec3(1, -3, -6));
    EXPECT_EQ(worldOf(plain, {1.5, 1.5, 1.5}), glm::dvec3(-1, 0, -2));
    EXPECT_THAT(plain.notes, ElementsAre(HasSubstr("which side is left")));
    EXPECT_EQ(plain.length_unit, "");
    // An affine of zeros says nothing.
    both.sform(1, {});
    EXPECT_EQ(worldOf(infoOf(both), {0.5, 0.5, 0.5}), glm::dvec3(7, 8, 9));
    EXPECT_THAT(infoOf(both).notes, ElementsAre(HasSubstr("does not span space")));
  }
}

TEST(ImportNifti, KeepsWhatValuesMean) {
  const Scratch scratch;
  const auto valueOf = [&](NiftiFile file, const std::string& voxels) {
    const auto source = openSource({scratch.write("a.nii", file.dims({2}).sform(1, kPlain).bytes() + voxels)}, {});
    const std::string stored = readAll(*source);
    const SourceInfo& info = source->info();
    EXPECT_GT(info.channels[0].value_scale, 0);
    const auto* second = reinterpret_cast<const std::byte*>(&stored[stored.size() / 2]);
    return info.channels[0].value_offset +
           info.channels[0].value_scale * static_cast<double>(storedDensity(info.type, second));
  };
  const std::string words = bytesOf<std::int16_t>({-5, 7});
  EXPECT_EQ(valueOf(NiftiFile().type(4).slope(0.5, 10), words), 13.5);
  EXPECT_EQ(valueOf(NiftiFile().type(4).slope(-2, 10), words), -4);
  EXPECT_EQ(valueOf(NiftiFile().type(512).slope(-2, 10), bytesOf<std::uint16_t>({5, 7})), -4);
  EXPECT_EQ(valueOf(NiftiFile().type(2).slope(-2, 10), "\x05\x07"), -4);
  EXPECT_EQ(valueOf(NiftiFile().type(256).slope(-2, 10), "\x05\x07"), -4);
  EXPECT_EQ(valueOf(NiftiFile().type(16).slope(-2, 10), bytesOf<float>({5, 7.25f})), -4.5);
  EXPECT_EQ(valueOf(NiftiFile().type(64).slope(-2, 10), bytesOf<double>({5, 7.25})), -4.5);
  EXPECT_EQ(valueOf(NiftiFile().type(4).slope(0, 10), words), 7) << "a slope of 0 says nothing";
  EXPECT_EQ(valueOf(NiftiFile().type(4).slope(std::nan(""), 0), words), 7);
  EXPECT_THAT(refusal({scratch.write("b", NiftiFile().slope(1, HUGE_VAL).dims({1}).bytes() + "v")}),
              HasSubstr("scl_inter"));
  // Labels by their intent: as far as the file that is built.
  const auto labels =
      openSource({scratch.write("c", NiftiFile().type(512).dims({2}).sform(1, kPlain).intent(1002).bytes() +
                                         bytesOf<std::uint16_t>({5, 7}))},
                 {});
  BuildOptions build;
  build.values = ValuesRule::guess;
  buildVolume(*labels, scratch.path("v.bwv"), build);
  EXPECT_EQ(VolumeFile(scratch.path("v.bwv")).info().channels[0].values, ChannelValues::labels);
  build.values = ValuesRule::intensity;
  buildVolume(*labels, scratch.path("w.bwv"), build);
  EXPECT_EQ(VolumeFile(scratch.path("w.bwv")).info().channels[0].values, ChannelValues::intensity);
}

TEST(ImportNifti, VolumesAreChannelsOrFrames) {
  const Scratch scratch;
  const auto files = [&](int count, std::int16_t type, const std::string& voxels) {
    const std::string all = NiftiFile().type(type).dims({2, 1, 1, count}).sform(1, kPlain).bytes() + voxels;
    return std::vector{scratch.write("a.nii", all), scratch.write("a.nii.gz", gzipped(all))};
  };
  for (const auto& file : files(3, 2, "aabbcc")) {
    const auto source = openSource({file}, {});
    ASSERT_EQ(source->info().channels.size(), 3u);
    EXPECT_EQ(readAll(*source), "aabbcc");
    ImportOptions second;
    second.frame = 1;
    EXPECT_EQ(importAll(file, second), "bb");
    second.frame = 3;
    EXPECT_THAT(refusal({file}, second), HasSubstr("--frame 3 is outside 0..2"));
  }
  for (const auto& file : files(5, 2, "aabbccddee")) {
    EXPECT_EQ(importAll(file), "aa");
    EXPECT_THAT(openSource({file}, {})->info().notes, ElementsAre(HasSubstr("dim: of 5 volumes")));
  }
  for (const auto& file : files(1, 2, "aa")) EXPECT_THAT(openSource({file}, {})->info().notes, IsEmpty());
  for (const auto& file : files(2, 128, "abcdefghijkl")) EXPECT_EQ(importAll(file), "abccdeff");
  const auto vectors = NiftiFile().dims({2, 1, 1, 1, 2}).sform(1, kPlain).bytes() + "aabb";
  EXPECT_EQ(openSource({scratch.write("v", vectors)}, {})->info().channels.size(), 2u);
}

TEST(ImportNifti, ReadsPairsExtensionsAndAnalyze) {
  const Scratch scratch;
  const std::string pair = NiftiFile().magic(std::string_view("ni1\0", 4)).dims({4}).sform(1, kPlain).offset(0).bytes();
  scratch.write("p.hdr", pair);
  scratch.write("p.img", "abcd");
  EXPECT_EQ(importAll(scratch.path("p.hdr")), "abcd");
  EXPECT_EQ(importAll(scratch.path("p.img")), "abcd") << "either of the two";
  scratch.write("q.hdr", pair);
  scratch.write("q.img.gz", gzipped("efgh"));
  EXPECT_EQ(importAll(scratch.path("q.hdr")), "efgh");
  scratch.write("r.hdr.gz", gzipped(pair));
  EXPECT_THAT(refusal({scratch.path("r.hdr.gz")}), HasSubstr("r.img is not there"));
  const std::string extended = NiftiFile().dims({4}).sform(1, kPlain).offset(400).bytes() + std::string(48, 'x');
  EXPECT_EQ(importAll(scratch.write("e.nii", extended + "abcd")), "abcd");
  EXPECT_EQ(importAll(scratch.write("f.nii.gz", gzipped(extended + "abcd"))), "abcd");
  // 7.5: no magic, no place, and neither slope nor unit, wherever other bytes stand.
  std::string analyze = NiftiFile()
                            .magic(std::string_view("\0\0\0\0", 4))
                            .dims({2, 2})
                            .pixdim(1, 3)
                            .slope(9, 9)
                            .units(2)
                            .offset(0)
                            .bytes();
  analyze[38] = 'r';
  scratch.write("s.hdr", analyze.substr(0, 348));
  scratch.write("s.img", "abcd");
  const auto source = openSource({scratch.path("s.img")}, {});
  EXPECT_EQ(readAll(*source), "abcd");
  EXPECT_EQ(source->info().channels[0].value_scale, 1);
  EXPECT_EQ(worldOf(source->info(), {0.5, 0.5, 0.5}), glm::dvec3(1.5, -0.5, 0));
  EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("which side is left")));
}

TEST(ImportNifti, NamesTheFieldThatIsWrong) {
  const Scratch scratch;
  const auto plain = [] { return NiftiFile().dims({2, 2, 2}).sform(1, kPlain); };
  const std::pair<std::string, const char*> cases[] = {
      {plain().type(32).bytes(), "datatype: 32 (64-bit complex) cannot be read"},
      {plain().type(1792).bytes(), "datatype: 1792 (128-bit complex)"},
      {plain().type(1536).bytes(), "128-bit float"},
      {plain().type(-9510).bytes(), "datatype: -9510 is not known"},
      {plain().dims({2, 0, 2}).bytes(), "dim[2]: 0 is outside"},
      {plain().dims({2, -1, 2}).bytes(), "dim[2]: -1 is outside"},
      {plain().dims({2, 2, 2, 32767, 32767}).bytes(), "dim[5]: more than 65536 volumes"},
      {plain().dims({32767, 32767, 32767, 32767}).bytes(), "bytes of voxels are declared"},
      {NiftiFile(true).dims({70000}).bytes(), "dim[1]: 70000 is outside"},
      {plain().offset(100).bytes(), "vox_offset: 100 is outside"},
      {plain().offset(-1).bytes(), "vox_offset: -1"},
      {plain().offset(std::nan("")).bytes(), "vox_offset: nan"},
      {plain().offset(1e30).bytes(), "vox_offset"},
      {plain().offset(5000).bytes(), "8 bytes of voxels are declared, 0 are there"},
      {plain().sform(1, {1, 0, 0, HUGE_VAL, 0, 1, 0, 0, 0, 0, 1, 0}).bytes(), "srow: inf is not finite"},
      {plain().sform(0, kPlain).qform(1, 1, {2, 0, 0, 0, 0, 0}).bytes(), "quatern"},
      {plain().sform(0, kPlain).qform(1, 1, {0, 0, 0, std::nan(""), 0, 0}).bytes(), "the origin nan is not finite"},
      {plain().bytes() + "1234567", "8 bytes of voxels are declared, 7 are there"},
  };
  for (const auto& [bytes, message] : cases) {
    EXPECT_THAT(refusal({scratch.write("a.nii", bytes)}), AllOf(HasSubstr("a.nii"), HasSubstr(message)));
  }
  EXPECT_THAT(openSource({scratch.write("b.nii", plain().bytes() + "12345678\n")}, {})->info().notes,
              ElementsAre(HasSubstr("1 bytes behind")));
  std::string axes = plain().bytes();
  axes[40] = 8;
  EXPECT_THAT(refusal({scratch.write("c.nii", axes)}), HasSubstr("dim[0]: 8 axes"));
}

// Broken anywhere: an error, or a volume, whatever the file says.
TEST(ImportNifti, SurvivesCutsAndFlippedBits) {
  const Scratch scratch;
  const std::string voxels = bytesOf<float>(std::vector<float>(60, 1.5f));
  const std::string whole = NiftiFile().type(16).dims({3, 4, 5}).sform(1, kPlain).bytes() + voxels;
  ImportOptions options;
  options.memory_bytes = std::uint64_t{64} << 20;
  const auto outcome = [&](const std::string& bytes) {
    try {
      return static_cast<int>(importAll(scratch.write("x.nii", bytes), options).size());
    } catch (const DataError&) {
      return -1;
    }
  };
  for (const std::string& bytes : {whole, gzipped(whole)}) {
    forEachCut(bytes, [&](const std::string& cut) { EXPECT_EQ(outcome(cut), -1) << cut.size(); });
    int right = 0;
    forEachFlippedBit(bytes, [&](const std::string& broken) { right += outcome(broken) == 240 ? 1 : 0; });
    EXPECT_GT(right, bytes == whole ? 300 : 0);
  }
}

}  // namespace
}  // namespace blockwalk
