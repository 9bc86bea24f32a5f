// SPDX-License-Identifier: Apache-2.0
#include "tests/volume/allocations.h"
#include "tests/volume/import/slices/tiff_writer.h"
#include "volume/build/builder.h"
#include "volume/file/file.h"

namespace blockwalk {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using volume_test::allocations;

TEST(ImportTiffDescription, ReadsHyperstacksOfImageJAndOme) {
  const Scratch scratch;
  const auto pages = [](const PageKind& kind, std::initializer_list<int> numbers) {
    std::string all;
    for (const int page : numbers) all += pixelsOf(kind, page);
    return all;
  };
  const PageKind image_j{.bits = 16, .description = "ImageJ=1.54f\nimages=6\nchannels=2\nslices=3\nhyperstack=true\n"};
  const auto file = writeTiff(scratch, image_j, 6);
  const auto source = openSource({file}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(20, 18, 3));
  ASSERT_EQ(source->info().channels.size(), 2u);
  EXPECT_EQ(readAll(*source), pages(image_j, {0, 2, 4, 1, 3, 5}));
  EXPECT_EQ(readAll(*source, 18), pages(image_j, {0, 2, 4, 1, 3, 5}));

  const PageKind channels_first{
      .description = "<?xml?><OME><Pixels DimensionOrder=\"XYCZT\" SizeC=\"3\" SizeT=\"1\" SizeZ=\"2\"/></OME>"};
  EXPECT_EQ(importAll(writeTiff(scratch, channels_first, 6)), pages(channels_first, {0, 3, 1, 4, 2, 5}));
  const PageKind slices_first{
      .description =
          "<?xml?><OME><Pixels DimensionOrder=\"XYZCT\" SizeZ=\"3\" SizeC=\"2\" SizeT=\"1\">"
          "<Channel ID=\"0\" Name=\"DAPI &amp; more\"/><Channel ID=\"1\" Name=\"GFP\"/></Pixels></OME>"};
  const auto named = openSource({writeTiff(scratch, slices_first, 6)}, {});
  ASSERT_EQ(named->info().channels.size(), 2u);
  EXPECT_EQ(named->info().channels[0].name, "DAPI & more");
  EXPECT_EQ(named->info().channels[1].name, "GFP");
  EXPECT_EQ(readAll(*named), pages(slices_first, {0, 1, 2, 3, 4, 5}));
  ImportOptions color;
  color.channels = ChannelRule::color;
  EXPECT_THAT(refusal({file}, color), HasSubstr("planes of their own"));
}

TEST(ImportTiffDescription, RefusesHyperstacksAndMixtures) {
  const Scratch scratch;
  const PageKind many{.description = "ImageJ=1.54f\nimages=5\nchannels=5\nhyperstack=true\n"};
  EXPECT_THAT(refusal({writeTiff(scratch, many, 5)}), HasSubstr("channels=5: at most 4"));
  const PageKind uneven{.description = "ImageJ=1.54f\nimages=5\nchannels=2\nhyperstack=true\n"};
  EXPECT_THAT(refusal({writeTiff(scratch, uneven, 5)}), HasSubstr("5 pages, which are no whole slices of 2"));
  const PageKind frames{.description = "ImageJ=1.54f\nimages=4\nslices=2\nframes=2\n"};
  EXPECT_THAT(openSource({writeTiff(scratch, frames, 4)}, {})->info().notes,
              testing::ElementsAre(AllOf(HasSubstr("frames=2"), HasSubstr("--frame"))));
  const PageKind hidden{.description = "ImageJ=1.54f\nimages=9\nslices=9\n"};
  EXPECT_THAT(refusal({writeTiff(scratch, hidden)}), HasSubstr("images=9"));
  const PageKind ome{.description = "<?xml?><OME><Pixels SizeC=\"3\"/></OME>"};
  EXPECT_THAT(refusal({writeTiff(scratch, ome, 4)}), HasSubstr("SizeC=\"3"));
  const PageKind times{.description = "<?xml?><OME><Pixels SizeC=\"1\" SizeT=\"3\"/></OME>"};
  EXPECT_THAT(openSource({writeTiff(scratch, times, 3)}, {})->info().notes,
              testing::ElementsAre(AllOf(HasSubstr("SizeT=\"3"), HasSubstr("--frame"))));
  const PageKind slices{.description = "ImageJ=1.54f\nimages=2\nslices=2\n"};
  EXPECT_EQ(importAll(writeTiff(scratch, slices, 2)), pixelsOf(slices, 0) + pixelsOf(slices, 1));

  const auto one = writeTiff(scratch, {}, 1, "w", "s1.tif");
  const auto ten = writeTiff(scratch, {}, 1, "w", "s10.tif");
  EXPECT_EQ(openSource({ten, one}, {})->info().dims, glm::ivec3(20, 18, 2));
  EXPECT_THAT(refusal({one, writeTiff(scratch, {}, 2, "w", "s2.tif")}), HasSubstr("s2.tif: has 2 pages"));
  EXPECT_THAT(refusal({one, writeTiff(scratch, {.bits = 16}, 1, "w", "s3.tif")}), HasSubstr("s3.tif"));
  const PageKind four{.samples = 4, .photometric = PHOTOMETRIC_MINISBLACK};
  EXPECT_THAT(refusal({writeTiff(scratch, four)}), HasSubstr("SamplesPerPixel 4"));
  const PageKind real{.bits = 32, .samples = 3, .photometric = PHOTOMETRIC_RGB, .sample_format = SAMPLEFORMAT_IEEEFP};
  EXPECT_THAT(refusal({writeTiff(scratch, real)}), HasSubstr("colour must be u8 or u16"));
}

TEST(ImportTiffDescription, ReadsOmeAsXmlHasIt) {
  const Scratch scratch;
  const auto channelsOf = [&](const char* description) {
    return openSource({writeTiff(scratch, {.description = description}, 4)}, {})->info().channels;
  };
  // Other quotes, other white space, prefixes, comments and earlier elements that have the words too.
  EXPECT_EQ(channelsOf("<OME><Image><Pixels SizeC='2' SizeZ='2'/></Image></OME>").size(), 2u);
  EXPECT_EQ(channelsOf("<OME><Pixels\n\tSizeC=\"2\"\n\tSizeZ = \"2\"/></OME>").size(), 2u);
  EXPECT_EQ(channelsOf("<o:OME xmlns:o=\"x\"><o:Pixels SizeC=\"2\" SizeZ=\"2\"/></o:OME>").size(), 2u);
  EXPECT_EQ(channelsOf("<OME><!-- SizeC=\"2\" SizeZ=\"2\" --><Pixels SizeC=\"1\" SizeZ=\"4\"/></OME>").size(), 1u);
  EXPECT_EQ(channelsOf("<OME><Plate SizeC=\"2\"/><Pixels SizeC=\"1\" SizeZ=\"4\"/></OME>").size(), 1u);
  const auto named = channelsOf(
      "<OME><Pixels SizeC=\"2\" SizeZ=\"2\"><Channel\nName='&#65;\xc3\xa9'/><Channel ID=\"1\" "
      "Name=\"B\"/></Pixels></OME>");
  ASSERT_EQ(named.size(), 2u);
  EXPECT_EQ(named[0].name, "A\xc3\xa9");
  EXPECT_EQ(channelsOf("a note of <OME> and SizeC=\"2\"").size(), 1u);
  const auto refused = [&](const char* description) {
    return refusal({writeTiff(scratch, {.description = description}, 4)});
  };
  EXPECT_THAT(refused("<OME><Pixels SizeC=\"2\""), HasSubstr("its XML is broken at byte"));
  EXPECT_THAT(refused("<OME><Image/></OME>"), HasSubstr("has no Pixels"));
  EXPECT_THAT(refused("<OME><Pixels SizeC=\"two\"/></OME>"), HasSubstr("SizeC=\"two\" is no whole number"));
  EXPECT_THAT(refused("<OME><Pixels SizeC=\"-2\" SizeZ=\"-2\"/></OME>"), HasSubstr("SizeC=\"-2\""));
}

TEST(ImportTiffDescription, TakesSizesUnitsAndColoursOfOme) {
  const Scratch scratch;
  const auto open = [&](const std::string& pixels, const ImportOptions& options = {}) {
    const std::string text = "<OME><Image><Pixels " + pixels + "</Pixels></Image></OME>";
    return openSource({writeTiff(scratch, {.description = text.c_str()}, 4)}, options);
  };
  const auto sides = [](const Source& source) {
    const glm::dmat4& map = source.info().world_from_index;
    return glm::dvec3(map[0][0], map[1][1], map[2][2]);
  };
  const std::string size = "SizeC='2' SizeZ='2' PhysicalSizeX='0.5' PhysicalSizeY='0.25' PhysicalSizeZ='1500' ";
  const std::string channels =
      "<Channel Name='DAPI' Color='65535'/>"      // blue, opaque
      "<Channel Name='GFP' Color='-16711681'/>";  // red and blue
  const auto whole = open(size + "PhysicalSizeZUnit='nm'>" + channels);
  EXPECT_EQ(sides(*whole), glm::dvec3(0.5, 0.25, 1500 * (1e-9 / 1e-6)));
  EXPECT_EQ(whole->info().length_unit, "um");
  ASSERT_EQ(whole->info().channels.size(), 2u);
  EXPECT_EQ(whole->info().channels[0].color, (std::array<std::uint8_t, 3>{0, 0, 255}));
  EXPECT_EQ(whole->info().channels[1].color, (std::array<std::uint8_t, 3>{255, 0, 255}));
  EXPECT_EQ(whole->info().channels[1].name, "GFP");

  // As far as the file: what the importer learned is what readers are told.
  BuildOptions build;
  buildVolume(*whole, scratch.path("v.bwv"), build);
  const VolumeFile file(scratch.path("v.bwv"));
  EXPECT_EQ(file.info().metadata.length_unit, "um");
  EXPECT_EQ(file.info().channels[0].color, (Color{0, 0, 255}));
  EXPECT_EQ(file.info().channels[0].name, "DAPI");

  const auto unit = [&](const std::string& name) {
    const std::string attributes = fmt::format("PhysicalSizeXUnit='{0}' PhysicalSizeYUnit='{0}' ", name);
    return open(size + attributes + fmt::format("PhysicalSizeZUnit='{}'>", name));
  };
  EXPECT_EQ(unit("mm")->info().length_unit, "mm");
  EXPECT_EQ(unit("\xce\xbcm")->info().length_unit, "um");
  EXPECT_EQ(sides(*unit("ft")), glm::dvec3(0.5, 0.25, 1500));
  EXPECT_EQ(unit("ft")->info().length_unit, "ft");
  EXPECT_EQ(sides(*unit("pixel")), glm::dvec3(0.5, 0.25, 1500));
  EXPECT_EQ(unit("pixel")->info().length_unit, "");
  EXPECT_EQ(unit(std::string(65, 'u'))->info().length_unit, "");

  // What is said in part, or in units that do not go together, says nothing.
  for (const char* part : {"SizeC='2' SizeZ='2' PhysicalSizeY='2' PhysicalSizeZ='2'>",
                           "SizeC='1' SizeZ='4' PhysicalSizeX='2' PhysicalSizeY='2' PhysicalSizeZ='2' "
                           "PhysicalSizeYUnit='ell'>",
                           "SizeC='1' SizeZ='4'>"}) {
    EXPECT_EQ(sides(*open(part)), glm::dvec3(1)) << part;
    EXPECT_EQ(open(part)->info().length_unit, "") << part;
  }
  const auto flat = open("SizeC='2' SizeZ='2' PhysicalSizeX='2' PhysicalSizeY='3'>");
  EXPECT_EQ(sides(*flat), glm::dvec3(2, 3, 2));
  EXPECT_THAT(flat->info().notes, testing::ElementsAre(HasSubstr("PhysicalSizeZ is not said")));
  // The user's spacing wins; colours that are none are left out.
  ImportOptions spaced;
  spaced.spacing = glm::dvec3(3, 4, 5);
  EXPECT_EQ(sides(*open(size + ">", spaced)), glm::dvec3(3, 4, 5));
  const auto odd = open(size + "><Channel Color='4294967296'/><Channel Color='red'/>");
  EXPECT_EQ(odd->info().channels[0].color, std::nullopt);
  EXPECT_EQ(odd->info().channels[1].color, std::nullopt);
  EXPECT_EQ(odd->info().channels[0].name, "");
  for (const char* wrong : {"0", "-1", "nan", "inf", "wide"}) {
    const std::string text = fmt::format("<OME><Pixels PhysicalSizeX='{}'/></OME>", wrong);
    EXPECT_THAT(refusal({writeTiff(scratch, {.description = text.c_str()}, 4)}),
                HasSubstr(fmt::format("PhysicalSizeX=\"{}\" is no finite number above 0", wrong)));
  }
}

// libtiff leaves a text out that it has no memory for: the pages would be slices, and no word of it.
TEST(ImportTiffDescription, WhatThereIsNoMemoryForIsRefused) {
  const Scratch scratch;
  const std::string text =
      "ImageJ=1.54\nimages=4\nchannels=2\nslices=2\nInfo=" + std::string(std::size_t{2} << 20, 'x');
  const auto file = writeTiff(scratch, {.description = text.c_str()}, 4);
  ImportOptions options;
  EXPECT_EQ(openSource({file}, options)->info().channels.size(), 2u);
  options.memory_bytes = std::uint64_t{1} << 20;
  EXPECT_THAT(refusal({file}, options), AllOf(HasSubstr("ImageDescription"), HasSubstr("--memory")));
}

// Every page's directory names the same text of 1 MiB, which must be kept once.
TEST(ImportTiffDescription, KeepsOneDescriptionOfAll) {
  const Scratch scratch;
  const std::string text(std::size_t{1} << 20, 'x');
  constexpr int kPages = 600;
  const auto file = writeTiff(scratch, {.width = 4, .height = 4, .description = "x"}, kPages, "wl");
  std::ifstream stream(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  const auto end = static_cast<std::uint32_t>(bytes.size());
  const auto get32 = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, &bytes[at], 4);
    return value;
  };
  for (std::uint32_t directory = get32(4); directory != 0;) {
    std::uint16_t count = 0;
    std::memcpy(&count, &bytes[directory], 2);
    for (std::size_t at = directory + 2; at < directory + 2 + 12u * count; at += 12) {
      std::uint16_t tag = 0;
      std::memcpy(&tag, &bytes[at], 2);
      if (tag != TIFFTAG_IMAGEDESCRIPTION) continue;
      const std::uint32_t length = static_cast<std::uint32_t>(text.size());
      std::memcpy(&bytes[at + 4], &length, 4);
      std::memcpy(&bytes[at + 8], &end, 4);
    }
    directory = get32(directory + 2 + 12u * count);
  }
  const auto shared = scratch.write("shared.tif", bytes + text.substr(1) + std::string(1, '\0'));
  const std::uint64_t before = allocations().bytes;
  volume_test::forgetMost();
  const auto source = openSource({shared}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(4, 4, kPages));
  EXPECT_LT(allocations().bytes, before + (std::uint64_t{4} << 20));
  EXPECT_LT(allocations().most, before + (std::uint64_t{16} << 20)) << "600 texts are 600 MiB";
}

}  // namespace
}  // namespace blockwalk
