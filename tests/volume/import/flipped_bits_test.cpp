// SPDX-License-Identifier: Apache-2.0
// Files that are broken anywhere, by a cut or by one bit: an error, or a volume.
#include "tests/volume/import/broken.h"
#include "tests/volume/import/slices/tiff_writer.h"

namespace blockwalk {
namespace {

class FlippedBits : public testing::Test {
 protected:
  // The voxels; nothing where the file is refused.
  std::optional<std::string> outcome(const std::string& bytes) {
    ImportOptions options;
    options.memory_bytes = std::uint64_t{16} << 20;
    try {
      const auto source = openSource({scratch_.write("x", bytes)}, options);
      const SourceInfo& info = source->info();
      const std::uint64_t voxels = static_cast<std::uint64_t>(info.dims.x) * static_cast<std::uint64_t>(info.dims.y) *
                                   static_cast<std::uint64_t>(info.dims.z);
      if (voxels > 1000000) return "large";  // a hole of a file may be
      return readAll(*source);
    } catch (const DataError&) {
      return std::nullopt;
    }
  }

  void expectSurvival(const std::string& whole) {
    const auto right = outcome(whole);
    ASSERT_TRUE(right.has_value());
    forEachCut(whole, [&](const std::string& cut) {
      const auto found = outcome(cut);
      EXPECT_TRUE(!found || *found == *right) << cut.size();
    });
    int read = 0;
    forEachFlippedBit(whole, [&](const std::string& broken) { read += outcome(broken) ? 1 : 0; });
    EXPECT_GT(read, 0);
    EXPECT_LT(read, 1000);
  }

  std::string contents(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  Scratch scratch_;
};

TEST_F(FlippedBits, OfTextHeaders) {
  const std::string voxels = bytesOf(std::vector<std::uint16_t>(60, 7));
  const std::string nrrd =
      "NRRD0005\ntype: ushort\ndimension: 4\nsizes: 3 4 5 1\nendian: little\nspace: LAS\n"
      "space directions: (1,0,0) (0,2,0) (0,0,3) none\nspace origin: (1,2,3)\nkinds: space space space list\n";
  expectSurvival(nrrd + "encoding: raw\n\n" + voxels);
  expectSurvival(nrrd + "encoding: gzip\n\n" + gzipped(voxels));
  std::string hex;
  for (const char byte : voxels) hex += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  expectSurvival(nrrd + "encoding: hex\n\n" + hex);
  expectSurvival(
      "ObjectType = Image\nNDims = 3\nDimSize = 3 4 5\nElementSpacing = 1 2 3\nElementType = MET_USHORT\n"
      "ElementToIntensityFunctionSlope = 2\nElementDataFile = LOCAL\n" +
      voxels);
}

TEST_F(FlippedBits, OfTiff) {
  expectSurvival(contents(writeTiff(scratch_, {.bits = 16, .tile = 16, .orientation = 6}, 2, "wl")));
  expectSurvival(contents(writeTiff(scratch_, {.compression = COMPRESSION_LZW, .orientation = 3}, 2, "wb")));
  const PageKind image_j{.description = "ImageJ=1.53t\nimages=2\nslices=2\nunit=um\nspacing=2\nc0=1\nc1=-2\n"};
  expectSurvival(contents(writeTiff(scratch_, image_j, 2, "w8")));
  const PageKind ome{
      .description =
          "<OME><Pixels SizeZ='2' PhysicalSizeX='2'><TiffData IFD='1'/><TiffData FirstZ='1'/></Pixels></OME>"};
  expectSurvival(contents(writeTiff(scratch_, ome, 2, "wl")));
}

}  // namespace
}  // namespace blockwalk
