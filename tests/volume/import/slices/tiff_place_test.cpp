// SPDX-License-Identifier: Apache-2.0
// Where TIFF slices lie and what their values mean: by tags, as ImageJ has it, and as OME-TIFF orders its planes.
#include "tests/volume/import/slices/tiff_writer.h"

namespace blockwalk {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

glm::dvec3 sidesOf(const SourceInfo& info) {
  return {info.world_from_index[0][0], info.world_from_index[1][1], info.world_from_index[2][2]};
}

class TiffPlace : public testing::Test {
 protected:
  SourceInfo infoOf(const PageKind& kind, int pages = 2, const ImportOptions& options = {}) {
    return openSource({writeTiff(scratch_, kind, pages)}, options)->info();
  }
  SourceInfo imageJ(const std::string& lines, PageKind kind = {}) {
    const std::string text = "ImageJ=1.54f\nimages=2\nslices=2\n" + lines;
    kind.description = text.c_str();
    return infoOf(kind);
  }
  SourceInfo ome(const std::string& pixels, int pages) {
    const std::string text = "<OME><Image><Pixels " + pixels + "</Pixels></Image></OME>";
    return infoOf({.description = text.c_str()}, pages);
  }
  std::string orderOf(const std::string& pixels, int pages, const ImportOptions& options = {}) {
    const std::string text = "<OME><Image><Pixels " + pixels + "</Pixels></Image></OME>";
    const auto source = openSource({writeTiff(scratch_, {.description = text.c_str()}, pages)}, options);
    const std::string voxels = readAll(*source);
    const std::size_t page_bytes = 20 * 18;
    std::string order;
    for (std::size_t at = 0; at < voxels.size(); at += page_bytes) {
      const std::string slice = voxels.substr(at, page_bytes);
      char found = slice == std::string(page_bytes, '\0') ? '.' : '?';
      for (int page = 0; page < pages; ++page) {
        if (slice == pixelsOf({}, page)) found = static_cast<char>('0' + page);
      }
      order += found;
    }
    return order;
  }

  Scratch scratch_;
};

TEST_F(TiffPlace, ResolutionIsASize) {
  const auto tags = [](float x, float y, int unit) {
    return PageKind{.x_resolution = x, .y_resolution = y, .resolution_unit = unit};
  };
  const SourceInfo inch = infoOf(tags(254, 508, RESUNIT_INCH));
  EXPECT_EQ(sidesOf(inch), glm::dvec3(25.4 / 254, 25.4 / 508, 25.4 / 254));
  EXPECT_EQ(inch.length_unit, "mm");
  EXPECT_THAT(inch.notes, ElementsAre(HasSubstr("how far apart slices are")));
  EXPECT_THAT(infoOf(tags(254, 508, RESUNIT_INCH), 1).notes, IsEmpty());
  const SourceInfo centimetre = infoOf(tags(1000, 1000, RESUNIT_CENTIMETER));
  EXPECT_EQ(sidesOf(centimetre), glm::dvec3(0.01));
  EXPECT_EQ(centimetre.length_unit, "mm");
  const SourceInfo unitless = infoOf(tags(1, 2, RESUNIT_NONE));
  EXPECT_EQ(sidesOf(unitless), glm::dvec3(1, 0.5, 1));
  EXPECT_EQ(unitless.length_unit, "");
  for (const PageKind& nothing : {tags(1, 1, RESUNIT_NONE), tags(72, 72, RESUNIT_INCH), tags(0, 0, 0)}) {
    EXPECT_EQ(sidesOf(infoOf(nothing)), glm::dvec3(1));
    EXPECT_EQ(infoOf(nothing).length_unit, "");
  }
  PageKind turned = tags(10, 20, RESUNIT_CENTIMETER);
  turned.orientation = 6;
  EXPECT_EQ(sidesOf(infoOf(turned)), glm::dvec3(0.5, 1, 0.5));
  ImportOptions spaced;
  spaced.spacing = glm::dvec3(3, 4, 5);
  EXPECT_EQ(sidesOf(infoOf(tags(254, 254, RESUNIT_INCH), 2, spaced)), glm::dvec3(3, 4, 5));
}

TEST_F(TiffPlace, ImageJSaysSizeUnitAndOrigin) {
  const PageKind four{.x_resolution = 4, .y_resolution = 2, .resolution_unit = RESUNIT_NONE};
  for (const char* unit : {"um", "micron", "microns", "\\u00B5m", "\xc2\xb5m", "\xce\xbcm", "\xb5m"}) {
    const SourceInfo info = imageJ(std::string("spacing=2.0\nunit=") + unit + "\nloop=false\n", four);
    EXPECT_EQ(sidesOf(info), glm::dvec3(0.25, 0.5, 2)) << unit;
    EXPECT_EQ(info.length_unit, "um") << unit;
  }
  EXPECT_EQ(sidesOf(imageJ("unit=mm\n", four)), glm::dvec3(0.25, 0.5, 1)) << "1 where spacing is not said";
  EXPECT_EQ(sidesOf(imageJ("unit=mm\nspacing=-3\n", four)), glm::dvec3(0.25, 0.5, 3));
  EXPECT_EQ(imageJ("unit=pixel\n", four).length_unit, "");
  EXPECT_EQ(imageJ("unit=cubit\n", four).length_unit, "cubit");
  EXPECT_EQ(sidesOf(imageJ("unit=um\nzunit=nm\nspacing=500\n", four)), glm::dvec3(0.25, 0.5, 0.5));
  const PageKind inches{.x_resolution = 10, .y_resolution = 10, .resolution_unit = RESUNIT_INCH};
  EXPECT_EQ(imageJ("", inches).length_unit, "in");
  EXPECT_EQ(sidesOf(imageJ("spacing=0.3\n", inches)), glm::dvec3(0.1, 0.1, 0.3));
  const SourceInfo placed = imageJ("unit=um\nspacing=2\nxorigin=8\nyorigin=4\nzorigin=1\n", four);
  EXPECT_EQ(glm::dvec3(placed.world_from_index[3]), glm::dvec3(-2, -2, -2));
}

// ResolutionUnit is inches where it is not written: that alone is no size.
TEST_F(TiffPlace, NoResolutionHasNoUnit) {
  for (const int unit : {0, RESUNIT_INCH, RESUNIT_CENTIMETER}) {
    const PageKind unsized{.resolution_unit = unit};
    EXPECT_EQ(imageJ("", unsized).length_unit, "") << unit;
    EXPECT_EQ(imageJ("spacing=2\n", unsized).length_unit, "") << unit;
    EXPECT_EQ(infoOf(unsized).length_unit, "") << unit;
    EXPECT_EQ(sidesOf(infoOf(unsized)), glm::dvec3(1)) << unit;
    EXPECT_EQ(imageJ("unit=um\nspacing=2\n", unsized).length_unit, "um") << unit;
    EXPECT_EQ(sidesOf(imageJ("unit=um\nspacing=2\n", unsized)), glm::dvec3(1, 1, 2)) << unit;
  }
}

TEST_F(TiffPlace, ImageJSaysWhatValuesMean) {
  const PageKind words{.bits = 16};
  const SourceInfo shifted = imageJ("cf=0\nc0=-32768.0\nc1=1.0\nvunit=Gray Value\n", words);
  EXPECT_EQ(shifted.channels[0].value_offset, -32768);
  EXPECT_EQ(shifted.channels[0].unit, "");
  const SourceInfo scaled = imageJ("c0=-1000\nc1=0.5\nvunit=HU\n", words);
  EXPECT_EQ(scaled.channels[0].value_scale, 0.5);
  EXPECT_EQ(scaled.channels[0].value_offset, -1000);
  EXPECT_EQ(scaled.channels[0].unit, "HU");
  const std::string text = "ImageJ=1.54f\nimages=2\nslices=2\nc0=10\nc1=-2\n";
  const PageKind falling{.bits = 16, .description = text.c_str()};
  const auto source = openSource({writeTiff(scratch_, falling, 2)}, {});
  const std::string voxels = readAll(*source);
  std::uint16_t stored = 0;
  std::memcpy(&stored, &voxels[2 * 3], 2);
  const SourceChannel& channel = source->info().channels[0];
  EXPECT_EQ(channel.value_scale, 2);
  EXPECT_EQ(channel.value_offset + channel.value_scale * stored, 10 - 2.0 * sampleAt(0, 3, 0, 0));
  EXPECT_THAT(imageJ("cf=20\nc0=1\nc1=2\n", words).notes, ElementsAre(HasSubstr("calibration function 20")));
  EXPECT_EQ(imageJ("cf=20\nc0=1\nc1=2\n", words).channels[0].value_scale, 1);
}

TEST_F(TiffPlace, FramesAreChosen) {
  const PageKind kind{.description = "ImageJ=1.54f\nimages=6\nslices=3\nframes=2\n"};
  const auto file = writeTiff(scratch_, kind, 6);
  EXPECT_EQ(importAll(file), pixelsOf(kind, 0) + pixelsOf(kind, 1) + pixelsOf(kind, 2));
  EXPECT_THAT(openSource({file}, {})->info().notes, ElementsAre(HasSubstr("frames=2: of 2 volumes")));
  ImportOptions second;
  second.frame = 1;
  EXPECT_EQ(importAll(file, second), pixelsOf(kind, 3) + pixelsOf(kind, 4) + pixelsOf(kind, 5));
  const PageKind film{.description = "ImageJ=1.54f\nimages=3\nframes=3\n"};
  const auto frames = openSource({writeTiff(scratch_, film, 3)}, {});
  EXPECT_EQ(frames->info().dims.z, 3);
  EXPECT_THAT(frames->info().notes, ElementsAre(HasSubstr("frames in time")));
  EXPECT_EQ(importAll(scratch_.path("a.tif"), second), pixelsOf(film, 1));
  EXPECT_EQ(orderOf("DimensionOrder='XYZTC' SizeZ='2' SizeT='3' SizeC='1'>", 6, second), "23");
  EXPECT_EQ(orderOf("DimensionOrder='XYTZC' SizeZ='2' SizeT='3' SizeC='1'>", 6, second), "14");
}

TEST_F(TiffPlace, OmePlanesAreWhereTiffDataSays) {
  const std::string sizes = "DimensionOrder='XYZCT' SizeZ='3' SizeC='1' SizeT='1'>";
  EXPECT_EQ(orderOf(sizes + "<TiffData IFD='2' FirstZ='0'/><TiffData IFD='1' FirstZ='1'/><TiffData FirstZ='2' "
                            "IFD='0' PlaneCount='1'/>",
                    3),
            "210");
  EXPECT_EQ(orderOf(sizes + "<TiffData/>", 3), "012");
  EXPECT_EQ(orderOf(sizes + "<TiffData FirstZ='1' IFD='0' PlaneCount='2'/><TiffData IFD='2'/>", 3), "201");
  const std::string two = "DimensionOrder='XYCZT' SizeZ='2' SizeC='2' SizeT='1'>";
  EXPECT_EQ(orderOf(two + "<TiffData/>", 4), "0213") << "channel after channel";
  EXPECT_EQ(orderOf(two + "<TiffData IFD='3' PlaneCount='1'/><TiffData FirstC='1' IFD='0'/><TiffData FirstZ='1' "
                          "IFD='1' PlaneCount='2'/>",
                    4),
            "3102");
  EXPECT_EQ(orderOf(sizes + "<TiffData IFD='2' FirstZ='0'/><TiffData IFD='1' FirstZ='2'/>", 3), "2.1");
  EXPECT_THAT(ome(sizes + "<TiffData IFD='2' FirstZ='0'/><TiffData IFD='1' FirstZ='2'/>", 3).notes,
              ElementsAre(HasSubstr("no page for 1 of 3 planes")));
  for (const auto& [block, message] :
       {std::pair("<TiffData IFD='3'/>", "no such page"),
        std::pair("<TiffData FirstZ='3'/>", "FirstZ=\"3\" is not below"),
        std::pair("<TiffData IFD='-1'/>", "IFD=\"-1\""),
        std::pair("<TiffData IFD='99999999999'/>", "IFD=\"99999999999\""),
        std::pair("<TiffData><UUID FileName='../x.tif'/></TiffData>", "is no file beside it"),
        std::pair("<TiffData><UUID FileName='a.tif'/></TiffData><TiffData><UUID FileName='no.tif'/></TiffData>",
                  "FileName=\"no.tif\": the file of this set is not there")}) {
    const std::string text = "<OME><Pixels " + sizes + block + "</Pixels></OME>";
    EXPECT_THAT(refusal({writeTiff(scratch_, {.description = text.c_str()}, 3)}), HasSubstr(message));
  }
}

TEST_F(TiffPlace, OmeSetsAreReadAsOne) {
  const std::string text =
      "<OME><Image><Pixels DimensionOrder='XYZCT' SizeZ='2' SizeC='2' SizeT='1' PhysicalSizeX='0.5'>"
      "<TiffData FirstC='0' IFD='0' PlaneCount='2'><UUID FileName='c0.ome.tif'>urn:uuid:0</UUID></TiffData>"
      "<TiffData FirstC='1' IFD='1' FirstZ='0'><UUID FileName='c1.ome.tif'>urn:uuid:1</UUID></TiffData>"
      "<TiffData FirstC='1' IFD='0' FirstZ='1'><UUID FileName='c1.ome.tif'>urn:uuid:1</UUID></TiffData>"
      "</Pixels></Image></OME>";
  PageKind kind{.description = text.c_str()};
  const auto first = writeTiff(scratch_, kind, 2, "w", "c0.ome.tif");
  kind.photometric = PHOTOMETRIC_MINISBLACK;
  TIFF* tiff = TIFFOpen(scratch_.path("c1.ome.tif").c_str(), "w");
  for (int page = 5; page < 7; ++page) {
    setFields(tiff, kind);
    writeRows(tiff, kind, page);
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  const std::string expected = pixelsOf(kind, 0) + pixelsOf(kind, 1) + pixelsOf(kind, 6) + pixelsOf(kind, 5);
  const auto source = openSource({first}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(20, 18, 2));
  EXPECT_EQ(source->info().channels.size(), 2u);
  EXPECT_EQ(sidesOf(source->info()), glm::dvec3(0.5));
  EXPECT_EQ(readAll(*source), expected);
  EXPECT_EQ(readAll(*openSource({scratch_.path("c1.ome.tif"), first}, {})), expected) << "any of the files";
  EXPECT_EQ(readAll(*openSource({scratch_.path("")}, {})), expected) << "and the folder";
  // One that was renamed is itself.
  const std::string alone =
      "<OME><Pixels SizeZ='2'><TiffData IFD='1' FirstZ='0'><UUID FileName='old.tif'/></TiffData>"
      "<TiffData IFD='0' FirstZ='1'><UUID FileName='old.tif'/></TiffData></Pixels></OME>";
  const auto renamed = writeTiff(scratch_, {.description = alone.c_str()}, 2, "w", "new.tif");
  EXPECT_EQ(importAll(renamed), pixelsOf(kind, 1) + pixelsOf(kind, 0));
}

TEST_F(TiffPlace, OmeMetadataMayLieBeside) {
  const char* only = "<OME><BinaryOnly MetadataFile='s.companion.ome' UUID='urn:uuid:1'/></OME>";
  const auto file = writeTiff(scratch_, {.description = only}, 2);
  EXPECT_THAT(refusal({file}), HasSubstr("s.companion.ome"));
  scratch_.write("s.companion.ome",
                 "<OME><Image><Pixels SizeZ='2' PhysicalSizeX='3' PhysicalSizeXUnit='nm'><TiffData IFD='1' "
                 "FirstZ='0'><UUID FileName='a.tif'/></TiffData><TiffData IFD='0' FirstZ='1'><UUID "
                 "FileName='a.tif'/></TiffData></Pixels></Image></OME>");
  const auto source = openSource({file}, {});
  EXPECT_EQ(readAll(*source), pixelsOf({}, 1) + pixelsOf({}, 0));
  EXPECT_EQ(source->info().length_unit, "nm");
  const char* outside = "<OME><BinaryOnly MetadataFile='../s.companion.ome'/></OME>";
  EXPECT_THAT(refusal({writeTiff(scratch_, {.description = outside}, 2)}), HasSubstr("is no file beside it"));
}

TEST_F(TiffPlace, OnlyTheFirstImageIsRead) {
  const char* text =
      "<OME><Image><Pixels SizeZ='2'><TiffData IFD='0' PlaneCount='2'/></Pixels></Image>"
      "<Image><Pixels SizeZ='1'><TiffData IFD='2'/></Pixels></Image></OME>";
  const auto source = openSource({writeTiff(scratch_, {.description = text}, 3)}, {});
  EXPECT_EQ(readAll(*source), pixelsOf({}, 0) + pixelsOf({}, 1));
  EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("holds 2 images")));
}

}  // namespace
}  // namespace blockwalk
