// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>
#include <sys/wait.h>
#include <tiffio.h>
#include <unistd.h>

#include <functional>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

struct PageKind {
  int width = 20;
  int height = 18;
  int bits = 8;
  int samples = 1;
  int photometric = PHOTOMETRIC_MINISBLACK;
  int sample_format = SAMPLEFORMAT_UINT;
  int planar = PLANARCONFIG_CONTIG;
  int compression = COMPRESSION_NONE;
  int rows_per_strip = 5;
  int tile = 0;
  int alpha = EXTRASAMPLE_UNASSALPHA;
  const char* description = nullptr;
};

void setFields(TIFF* tiff, const PageKind& kind) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kind.width);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kind.height);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.samples);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind.photometric);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, kind.sample_format);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, kind.planar);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind.compression);
  const std::uint16_t extra = static_cast<std::uint16_t>(kind.alpha);
  if (kind.samples == 2 || kind.samples == 4) TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &extra);
  if (kind.description != nullptr) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, kind.description);
  if (kind.tile > 0) {
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, kind.tile);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, kind.tile);
  } else {
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, kind.rows_per_strip);
  }
}

// One sample of page, pixel and channel: different everywhere, so that nothing can be swapped unseen.
std::uint32_t sampleAt(int page, int x, int y, int channel) {
  return static_cast<std::uint32_t>(page * 7919 + y * 1009 + x * 31 + channel * 5);
}

void putSample(std::string& bytes, std::size_t index, int bits, std::uint32_t value) {
  if (bits == 8) bytes[index] = static_cast<char>(value);
  if (bits == 16) {
    const auto narrow = static_cast<std::uint16_t>(value);
    std::memcpy(&bytes[index * 2], &narrow, 2);
  }
  if (bits == 32) {
    const auto real = static_cast<float>(value);
    std::memcpy(&bytes[index * 4], &real, 4);
  }
}

// Interleaved samples of a page.
std::string pixelsOf(const PageKind& kind, int page) {
  std::string bytes(static_cast<std::size_t>(kind.width * kind.height * kind.samples * kind.bits / 8), '\0');
  std::size_t index = 0;
  for (int y = 0; y < kind.height; ++y) {
    for (int x = 0; x < kind.width; ++x) {
      for (int c = 0; c < kind.samples; ++c) putSample(bytes, index++, kind.bits, sampleAt(page, x, y, c));
    }
  }
  return bytes;
}

void writeTiles(TIFF* tiff, const PageKind& kind, int page) {
  const bool apart = kind.planar == PLANARCONFIG_SEPARATE;
  const int in_tile = apart ? 1 : kind.samples;
  for (int plane = 0; plane < (apart ? kind.samples : 1); ++plane) {
    for (int y0 = 0; y0 < kind.height; y0 += kind.tile) {
      for (int x0 = 0; x0 < kind.width; x0 += kind.tile) {
        std::string tile(static_cast<std::size_t>(TIFFTileSize(tiff)), '\0');
        for (int y = 0; y < kind.tile; ++y) {
          for (int x = 0; x < kind.tile; ++x) {
            for (int c = 0; c < in_tile; ++c) {
              putSample(tile, static_cast<std::size_t>((y * kind.tile + x) * in_tile + c), kind.bits,
                        sampleAt(page, x0 + x, y0 + y, plane + c));
            }
          }
        }
        TIFFWriteTile(tiff, tile.data(), static_cast<std::uint32_t>(x0), static_cast<std::uint32_t>(y0), 0,
                      static_cast<std::uint16_t>(plane));
      }
    }
  }
}

void writeRows(TIFF* tiff, const PageKind& kind, int page) {
  const bool apart = kind.planar == PLANARCONFIG_SEPARATE;
  const int in_row = apart ? 1 : kind.samples;
  for (int plane = 0; plane < (apart ? kind.samples : 1); ++plane) {
    for (int y = 0; y < kind.height; ++y) {
      std::string row(static_cast<std::size_t>(kind.width * in_row * kind.bits / 8), '\0');
      for (int x = 0; x < kind.width; ++x) {
        for (int c = 0; c < in_row; ++c) {
          putSample(row, static_cast<std::size_t>(x * in_row + c), kind.bits, sampleAt(page, x, y, plane + c));
        }
      }
      TIFFWriteScanline(tiff, row.data(), static_cast<std::uint32_t>(y), static_cast<std::uint16_t>(plane));
    }
  }
}

// mode: "w" and "wb" big-endian, "wl" little-endian, "w8" BigTIFF
std::filesystem::path writeTiff(const Scratch& scratch, const PageKind& kind, int pages = 1, const char* mode = "w",
                                const std::string& name = "a.tif") {
  TIFF* tiff = TIFFOpen(scratch.path(name).c_str(), mode);
  for (int page = 0; page < pages; ++page) {
    setFields(tiff, kind);
    kind.tile > 0 ? writeTiles(tiff, kind, page) : writeRows(tiff, kind, page);
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  return scratch.path(name);
}

std::filesystem::path writePacked(const Scratch& scratch, const PageKind& kind, std::string row,
                                  const std::function<void(TIFF*)>& more = {}) {
  TIFF* tiff = TIFFOpen(scratch.path("packed.tif").c_str(), "w");
  setFields(tiff, kind);
  if (more) more(tiff);
  TIFFWriteScanline(tiff, row.data(), 0, 0);
  TIFFClose(tiff);
  return scratch.path("packed.tif");
}

TEST(ImportTiff, ReadsEveryLayout) {
  const Scratch scratch;
  for (const int tile : {0, 16}) {
    for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE}) {
      for (const char* mode : {"wl", "wb", "w8"}) {
        for (const int bits : {8, 16, 32}) {
          PageKind kind{.bits = bits, .compression = compression, .tile = tile};
          if (bits == 32) kind.sample_format = SAMPLEFORMAT_IEEEFP;
          EXPECT_EQ(importAll(writeTiff(scratch, kind, 2, mode)), pixelsOf(kind, 0) + pixelsOf(kind, 1))
              << tile << " " << compression << " " << mode << " " << bits;
        }
        for (const int planar : {PLANARCONFIG_CONTIG, PLANARCONFIG_SEPARATE}) {
          const PageKind kind{
              .samples = 4, .photometric = PHOTOMETRIC_RGB, .planar = planar, .compression = compression, .tile = tile};
          EXPECT_EQ(importAll(writeTiff(scratch, kind, 1, mode)), pixelsOf(kind, 0)) << tile << " " << planar;
        }
      }
    }
  }
}

TEST(ImportTiff, TurnsSignedAndInvertedSamples) {
  const Scratch scratch;
  const PageKind inverted{.photometric = PHOTOMETRIC_MINISWHITE};
  std::string expected = pixelsOf(inverted, 0);
  for (char& value : expected) value = static_cast<char>(~value);
  EXPECT_EQ(importAll(writeTiff(scratch, inverted)), expected);
  const PageKind with_sign{.bits = 16, .sample_format = SAMPLEFORMAT_INT};
  EXPECT_EQ(openSource({writeTiff(scratch, with_sign)}, {})->info().channels[0].value_offset, -32768);
}

TEST(ImportTiff, UnpacksBitsAndPalettes) {
  const Scratch scratch;
  const PageKind bits{.width = 10, .height = 1, .bits = 1};
  EXPECT_EQ(importAll(writePacked(scratch, bits, "\xa0\x40")), bytesOf<std::uint8_t>({1, 0, 1, 0, 0, 0, 0, 0, 0, 1}));
  const PageKind nibbles{.width = 3, .height = 1, .bits = 4};
  EXPECT_EQ(importAll(writePacked(scratch, nibbles, "\x0f\x70")), bytesOf<std::uint8_t>({0, 15, 7}));
  const PageKind indexed{.width = 2, .height = 1, .bits = 4, .photometric = PHOTOMETRIC_PALETTE};
  std::vector<std::uint16_t> red(16, 0), green(16, 0), blue(16, 0);
  red[1] = 255 * 257;
  green[2] = 10 * 257;
  const auto colors = [&](TIFF* tiff) { TIFFSetField(tiff, TIFFTAG_COLORMAP, red.data(), green.data(), blue.data()); };
  EXPECT_EQ(importAll(writePacked(scratch, indexed, "\x12", colors)),
            bytesOf<std::uint8_t>({255, 0, 0, 54, 0, 10, 0, 7}));
}

TEST(ImportTiff, DividesPremultipliedColour) {
  const Scratch scratch;
  const PageKind kind{
      .width = 2, .height = 1, .samples = 4, .photometric = PHOTOMETRIC_RGB, .alpha = EXTRASAMPLE_ASSOCALPHA};
  const std::string row = bytesOf<std::uint8_t>({64, 128, 0, 128, 9, 9, 9, 0});
  EXPECT_EQ(importAll(writePacked(scratch, kind, row)), bytesOf<std::uint8_t>({128, 255, 0, 128, 9, 9, 9, 0}));
}

TEST(ImportTiff, ReadsHyperstacksOfImageJAndOme) {
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

TEST(ImportTiff, RefusesHyperstacksAndMixtures) {
  const Scratch scratch;
  const PageKind many{.description = "ImageJ=1.54f\nimages=5\nchannels=5\nhyperstack=true\n"};
  EXPECT_THAT(refusal({writeTiff(scratch, many, 5)}), HasSubstr("channels=5: at most 4"));
  const PageKind uneven{.description = "ImageJ=1.54f\nimages=5\nchannels=2\nhyperstack=true\n"};
  EXPECT_THAT(refusal({writeTiff(scratch, uneven, 5)}), HasSubstr("5 pages, which are no whole slices of 2"));
  const PageKind frames{.description = "ImageJ=1.54f\nimages=4\nslices=2\nframes=2\n"};
  EXPECT_THAT(refusal({writeTiff(scratch, frames, 4)}), HasSubstr("frames=2"));
  const PageKind hidden{.description = "ImageJ=1.54f\nimages=9\nslices=9\n"};
  EXPECT_THAT(refusal({writeTiff(scratch, hidden)}), HasSubstr("images=9"));
  const PageKind ome{.description = "<?xml?><OME><Pixels SizeC=\"3\"/></OME>"};
  EXPECT_THAT(refusal({writeTiff(scratch, ome, 4)}), HasSubstr("SizeC=\"3"));
  const PageKind times{.description = "<?xml?><OME><Pixels SizeC=\"1\" SizeT=\"3\"/></OME>"};
  EXPECT_THAT(refusal({writeTiff(scratch, times, 3)}), HasSubstr("SizeT=\"3"));
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

TEST(ImportTiff, ReadsOmeAsXmlHasIt) {
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

// Every page's directory names the same text of 1 MiB, which must be kept once.
TEST(ImportTiff, KeepsOneDescriptionOfAll) {
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
  rlimit before{};
  getrlimit(RLIMIT_DATA, &before);
  // 600 texts would be 600 MiB.
  const rlimit tight{.rlim_cur = std::min<rlim_t>(before.rlim_max, rlim_t{300} << 20), .rlim_max = before.rlim_max};
  const pid_t child = fork();
  if (child == 0) {
    setrlimit(RLIMIT_DATA, &tight);
    try {
      _exit(openSource({shared}, {})->info().dims == glm::ivec3(4, 4, kPages) ? 0 : 2);
    } catch (...) {
      _exit(1);
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

// A G4 strip whose codes end early or are wrong: an error, or the same picture every time, never what memory held.
TEST(ImportTiff, BrokenFaxDataGivesNothingOfMemory) {
  const Scratch scratch;
  const PageKind kind{.width = 64, .height = 40, .bits = 1, .compression = COMPRESSION_CCITTFAX4, .rows_per_strip = 40};
  std::string packed(64 / 8 * 40, '\0');
  for (std::size_t i = 0; i < packed.size(); ++i) packed[i] = static_cast<char>(i * 37 % 251);
  const auto file = scratch.path("fax.tif");
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  setFields(tiff, kind);
  TIFFWriteEncodedStrip(tiff, 0, packed.data(), static_cast<tmsize_t>(packed.size()));
  TIFFClose(tiff);
  std::ifstream stream(file, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(stream), {}};
  ASSERT_EQ(importAll(file).size(), 64u * 40);
  // What the allocator hands out again holds other bytes each time.
  const auto outcome = [&](const std::filesystem::path& path, int fill) {
    for (int i = 0; i < 64; ++i) {
      const std::vector<unsigned char> used(static_cast<std::size_t>(64 + 16 * i), static_cast<unsigned char>(fill));
      volatile unsigned char kept = used[0];
      (void)kept;
    }
    try {
      return importAll(path);
    } catch (const DataError& error) {
      return std::string(error.what());
    }
  };
  int errors = 0;
  for (std::size_t at = 8; at < 300 && at < whole.size(); ++at) {
    std::string broken = whole;
    broken[at] = static_cast<char>(~broken[at]);
    const auto path = scratch.write("broken.tif", broken);
    const std::string first = outcome(path, 0x55);
    ASSERT_EQ(first, outcome(path, 0xaa)) << at;
    errors += first.size() == 64u * 40 ? 0 : 1;
  }
  EXPECT_GT(errors, 20);
}

TEST(ImportTiff, StaysWithinMemory) {
  const Scratch scratch;
  const auto file =
      writeTiff(scratch, {.width = 300, .height = 300, .compression = COMPRESSION_LZW, .rows_per_strip = 300});
  ImportOptions options;
  options.memory_bytes = 100000;
  EXPECT_THAT(refusal({file}, options), HasSubstr("--memory"));
  options.memory_bytes = 1 << 20;
  EXPECT_EQ(importAll(file, options).size(), 90000u);
}

TEST(ImportTiff, RefusesEveryCutOfAFile) {
  const Scratch scratch;
  const auto file = writeTiff(scratch, {.compression = COMPRESSION_LZW}, 2);
  std::ifstream stream(file, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(stream), {}};
  for (std::size_t length = 0; length < whole.size(); length += 3) {
    EXPECT_FALSE(refusal({scratch.write("cut.tif", whole.substr(0, length))}).empty()) << length;
  }
}

TEST(ImportTiff, EndsOnALoopOfDirectories) {
  const Scratch scratch;
  const auto file = writeTiff(scratch, {}, 1, "wl");
  std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
  std::uint32_t first = 0;
  stream.seekg(4);
  stream.read(reinterpret_cast<char*>(&first), 4);
  std::uint16_t count = 0;
  stream.seekg(first);
  stream.read(reinterpret_cast<char*>(&count), 2);
  stream.seekp(first + 2 + 12 * count);
  stream.write(reinterpret_cast<const char*>(&first), 4);  // the next directory is this one
  stream.close();
  EXPECT_THAT(refusal({file}), HasSubstr("page 1"));
}

}  // namespace
}  // namespace blockwalk
