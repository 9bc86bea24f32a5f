// SPDX-License-Identifier: Apache-2.0
// Coarser levels of TIFF pages, wherever their directories lie.
#include "tests/volume/import/broken.h"
#include "tests/volume/import/slices/tiff_writer.h"

namespace blockwalk {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

enum class Layout { sub_directories, behind_each, behind_all };

constexpr int kLevels = 3;

PageKind coarser(PageKind kind, int level) {
  kind.width = (kind.width + (1 << level) - 1) >> level;
  kind.height = (kind.height + (1 << level) - 1) >> level;
  kind.description = level > 0 ? nullptr : kind.description;
  if (level > 0) kind.x_resolution = kind.y_resolution = 0;
  return kind;
}

int samplesOf(int page, int level) { return page + 50 * level; }

void writeLevel(TIFF* tiff, const PageKind& kind, int page, int level) {
  const PageKind own = coarser(kind, level);
  setFields(tiff, own);
  if (level > 0) TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, FILETYPE_REDUCEDIMAGE);
  own.tile > 0 ? writeTiles(tiff, own, samplesOf(page, level)) : writeRows(tiff, own, samplesOf(page, level));
}

std::filesystem::path writePyramid(const Scratch& scratch, const PageKind& kind, Layout layout, int pages,
                                   const char* mode = "w", const std::string& name = "pyramid.tif") {
  TIFF* tiff = TIFFOpen(scratch.path(name).c_str(), mode);
  const int behind = layout == Layout::behind_all ? 1 : kLevels;
  for (int page = 0; page < pages; ++page) {
    for (int level = 0; level < behind; ++level) {
      // libtiff puts the directories that follow there.
      const std::array<std::uint64_t, kLevels - 1> places{};
      if (level == 0 && layout == Layout::sub_directories) {
        TIFFSetField(tiff, TIFFTAG_SUBIFD, kLevels - 1, places.data());
      }
      writeLevel(tiff, kind, page, level);
      TIFFWriteDirectory(tiff);
    }
  }
  for (int level = behind; level < kLevels; ++level) {
    for (int page = 0; page < pages; ++page) {
      writeLevel(tiff, kind, page, level);
      TIFFWriteDirectory(tiff);
    }
  }
  TIFFClose(tiff);
  return scratch.path(name);
}

std::string pixelsOfLevel(const PageKind& kind, int level, std::initializer_list<int> pages) {
  std::string all;
  for (const int page : pages) all += pixelsOf(coarser(kind, level), samplesOf(page, level));
  return all;
}

ImportOptions atLevel(int level) {
  ImportOptions options;
  options.level = level;
  return options;
}

glm::dvec3 sidesOf(const Source& source) {
  const glm::dmat4& map = source.info().world_from_index;
  return {map[0][0], map[1][1], map[2][2]};
}

TEST(ImportTiffLevels, AreReadWhereverTheyLie) {
  const Scratch scratch;
  const std::vector<PageKind> kinds = {
      {.width = 37, .height = 26, .bits = 16},
      {.width = 50, .height = 41, .tile = 16},
      {.width = 37, .height = 26, .samples = 4, .photometric = PHOTOMETRIC_RGB, .compression = COMPRESSION_LZW}};
  for (const Layout layout : {Layout::sub_directories, Layout::behind_each, Layout::behind_all}) {
    for (const PageKind& kind : kinds) {
      for (const char* mode : {"wl", "wb", "w8"}) {
        for (const int pages : {1, 3}) {
          const auto path = writePyramid(scratch, kind, layout, pages, mode);
          for (int level = 0; level < kLevels; ++level) {
            const auto source = openSource({path}, atLevel(level));
            const PageKind own = coarser(kind, level);
            ASSERT_EQ(source->info().dims, glm::ivec3(own.width, own.height, pages));
            EXPECT_THAT(source->info().notes, IsEmpty());
            const auto expected = pages == 1 ? pixelsOfLevel(kind, level, {0}) : pixelsOfLevel(kind, level, {0, 1, 2});
            EXPECT_EQ(readAll(*source), expected) << static_cast<int>(layout) << " " << mode << " " << level;
          }
          EXPECT_EQ(importAll(path), importAll(path, atLevel(0)));
          EXPECT_THAT(openSource({path}, {})->info().notes,
                      ElementsAre("of 3 levels it is the finest; --level chooses another"));
        }
      }
    }
  }
}

TEST(ImportTiffLevels, LieWhereTheFinestDoes) {
  const Scratch scratch;
  // 37 pixels become 19 and 10.
  const PageKind plain{.width = 37, .height = 26};
  const auto path = writePyramid(scratch, plain, Layout::sub_directories, 2);
  EXPECT_EQ(sidesOf(*openSource({path}, atLevel(2))), glm::dvec3(37.0 / 10, 26.0 / 7, 1));
  ImportOptions spaced = atLevel(1);
  spaced.spacing = glm::dvec3(3, 4, 5);
  EXPECT_EQ(sidesOf(*openSource({path}, spaced)), glm::dvec3(3, 4, 5));
  // The tags of the finest level are what holds, and the step of slices is that of its pixels.
  const PageKind tagged{.width = 37, .height = 26, .x_resolution = 4, .y_resolution = 2, .resolution_unit = 3};
  const auto by_tags = openSource({writePyramid(scratch, tagged, Layout::behind_each, 2)}, atLevel(1));
  EXPECT_EQ(sidesOf(*by_tags), glm::dvec3(2.5 * 37 / 19, 5 * 2, 2.5));
  EXPECT_EQ(by_tags->info().length_unit, "mm");
  // A page that lies on its side: its rows are seen as columns.
  PageKind turned = plain;
  turned.orientation = 6;
  const auto on_its_side = openSource({writePyramid(scratch, turned, Layout::sub_directories, 1)}, atLevel(1));
  EXPECT_EQ(on_its_side->info().dims, glm::ivec3(13, 19, 1));
  EXPECT_EQ(sidesOf(*on_its_side), glm::dvec3(2, 37.0 / 19, 1));
}

TEST(ImportTiffLevels, OfOmeAndImageJKeepTheirChannels) {
  const Scratch scratch;
  const PageKind ome{.width = 37,
                     .height = 26,
                     .description =
                         "<OME><Pixels DimensionOrder='XYCZT' SizeC='2' SizeZ='2' PhysicalSizeX='0.5' "
                         "PhysicalSizeY='0.5' PhysicalSizeZ='3'><TiffData IFD='0' PlaneCount='4'/></Pixels></OME>"};
  const auto source = openSource({writePyramid(scratch, ome, Layout::sub_directories, 4)}, atLevel(1));
  EXPECT_EQ(source->info().dims, glm::ivec3(19, 13, 2));
  ASSERT_EQ(source->info().channels.size(), 2u);
  EXPECT_EQ(readAll(*source), pixelsOfLevel(ome, 1, {0, 2, 1, 3}));
  EXPECT_EQ(sidesOf(*source), glm::dvec3(0.5 * 37 / 19, 1, 3));
  EXPECT_EQ(source->info().length_unit, "um");
  const PageKind image_j{.width = 37, .height = 26, .description = "ImageJ=1.54f\nimages=4\nchannels=2\nslices=2\n"};
  const auto stack = openSource({writePyramid(scratch, image_j, Layout::sub_directories, 4)}, atLevel(2));
  EXPECT_EQ(readAll(*stack), pixelsOfLevel(image_j, 2, {0, 2, 1, 3}));
  const PageKind one{
      .width = 37, .height = 26, .rows_per_strip = 26, .description = "ImageJ=1.54f\nimages=2\nslices=2\n"};
  EXPECT_THAT(refusal({writePyramid(scratch, one, Layout::sub_directories, 1)}, atLevel(1)),
              HasSubstr("images=2: level 1 is asked for, the slices of one directory have but one"));
}

TEST(ImportTiffLevels, OfSlicesAndSetsAreReadOfEachFile) {
  const Scratch scratch;
  const PageKind kind{.width = 37, .height = 26};
  const auto one = writePyramid(scratch, kind, Layout::sub_directories, 1, "w", "s1.tif");
  const auto two = writePyramid(scratch, kind, Layout::behind_all, 1, "w", "s2.tif");
  EXPECT_EQ(importAll(one, atLevel(1)), pixelsOfLevel(kind, 1, {0}));
  const auto both = openSource({one, two}, atLevel(1));
  EXPECT_EQ(readAll(*both), pixelsOfLevel(kind, 1, {0, 0}));
  EXPECT_THAT(refusal({one, writeTiff(scratch, kind, 1, "w", "s3.tif")}, atLevel(1)),
              HasSubstr("s3.tif: level 1 is asked for, must be 0..0"));
}

TEST(ImportTiffLevels, RefusesWhatIsNone) {
  const Scratch scratch;
  const PageKind kind{.width = 37, .height = 26};
  const auto path = writePyramid(scratch, kind, Layout::behind_each, 2);
  EXPECT_THAT(refusal({path}, atLevel(3)), HasSubstr("pyramid.tif: level 3 is asked for, must be 0..2"));
  EXPECT_THAT(refusal({path}, atLevel(-1)), HasSubstr("level -1 is asked for, must be 0..2"));
  EXPECT_THAT(refusal({writeTiff(scratch, kind, 2)}, atLevel(1)),
              HasSubstr("a.tif: level 1 is asked for, must be 0..0"));
  // A thumbnail of the first of several pages; one page of a kind of its own.
  const auto with = [&](const std::vector<PageKind>& pages, const std::vector<bool>& are_reduced) {
    TIFF* tiff = TIFFOpen(scratch.path("with.tif").c_str(), "w");
    for (std::size_t i = 0; i < pages.size(); ++i) {
      setFields(tiff, pages[i]);
      if (are_reduced[i]) TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, FILETYPE_REDUCEDIMAGE);
      writeRows(tiff, pages[i], static_cast<int>(i));
      TIFFWriteDirectory(tiff);
    }
    TIFFClose(tiff);
    return scratch.path("with.tif");
  };
  const PageKind small = coarser(kind, 1);
  const auto thumbnail = with({kind, small, kind}, {false, true, false});
  EXPECT_THAT(refusal({thumbnail}, atLevel(1)),
              AllOf(HasSubstr("must be 0..0"), HasSubstr("the reduced copies of 2 pages are 1, no level has all")));
  EXPECT_EQ(openSource({thumbnail}, {})->info().dims, glm::ivec3(37, 26, 2));
  const auto uneven = with({kind, small, small, kind, kind, small}, {false, true, true, false, false, true});
  EXPECT_THAT(refusal({uneven}, atLevel(1)), HasSubstr("the reduced copies of 3 pages are 3, no level has all"));
  PageKind deep = small;
  deep.bits = 16;
  EXPECT_THAT(
      refusal({with({kind, deep}, {false, true})}, atLevel(1)),
      HasSubstr("page 1: level 1 has 19 x 13 pixels of 1 x u16, which is no coarser copy of 37 x 26 of 1 x u8"));
  EXPECT_THAT(refusal({with({kind, kind}, {false, true})}, atLevel(1)), HasSubstr("no coarser copy"));
  EXPECT_THAT(refusal({with({kind, small, kind, coarser(kind, 2)}, {false, true, false, true})}, atLevel(1)),
              HasSubstr("the first slice has 19 x 13"));
}

TEST(ImportTiffLevels, SurviveCutsAndFlippedBits) {
  const Scratch scratch;
  for (const Layout layout : {Layout::sub_directories, Layout::behind_each}) {
    std::ifstream stream(writePyramid(scratch, {.bits = 16, .rows_per_strip = 18}, layout, 2, "wl"), std::ios::binary);
    const std::string whole{std::istreambuf_iterator<char>(stream), {}};
    ImportOptions options = atLevel(1);
    options.memory_bytes = std::uint64_t{16} << 20;
    const auto outcome = [&](const std::string& bytes) -> std::optional<std::string> {
      try {
        const auto source = openSource({scratch.write("x", bytes)}, options);
        const glm::dvec3 dims(source->info().dims);
        return dims.x * dims.y * dims.z > 1e6 ? "large" : readAll(*source);
      } catch (const DataError&) {
        return std::nullopt;
      }
    };
    const auto right = outcome(whole);
    ASSERT_TRUE(right.has_value());
    // A cut through the link to the next page is an end to libtiff.
    forEachCut(whole, [&](const std::string& cut) { EXPECT_TRUE(right->starts_with(outcome(cut).value_or(""))); });
    int read = 0;
    forEachFlippedBit(whole, [&](const std::string& broken) { read += outcome(broken) ? 1 : 0; });
    EXPECT_GT(read, 0);
    EXPECT_LT(read, 1000);
  }
}

}  // namespace
}  // namespace blockwalk
