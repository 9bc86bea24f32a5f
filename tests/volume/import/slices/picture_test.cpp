// SPDX-License-Identifier: Apache-2.0
#include <random>

#include "tests/volume/import/broken.h"
#include "tests/volume/import/slices/picture_writer.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

std::string randomBytes(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::string bytes(count, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

constexpr std::array<GifColorType, 4> kGreys{{{0, 0, 0}, {90, 90, 90}, {180, 180, 180}, {255, 255, 255}}};
constexpr std::array<GifColorType, 4> kColors{{{0, 0, 0}, {255, 0, 0}, {0, 200, 0}, {10, 20, 30}}};

std::string rgba(const std::string& indices) {  // of kColors; a point is transparent
  std::string pixels;
  for (const char index : indices) {
    if (index == '.') {
      pixels += std::string(4, '\0');
      continue;
    }
    const GifColorType& color = kColors[static_cast<std::size_t>(index - '0')];
    for (const GifByteType part : {color.Red, color.Green, color.Blue, GifByteType{255}}) {
      pixels += static_cast<char>(part);
    }
  }
  return pixels;
}

std::string indices(const std::string& digits) {
  std::string pixels = digits;
  for (char& pixel : pixels) pixel = static_cast<char>(pixel - '0');
  return pixels;
}

TEST(Pictures, JpegSlicesAreGreyOrColour) {
  const Scratch scratch;
  for (const bool is_progressive : {false, true}) {
    for (int z = 0; z < 3; ++z) {
      const std::string grey(20 * 12, static_cast<char>(10 + 100 * z));
      scratch.write(fmt::format("grey/s{}.jpg", z), jpegFile(grey, 20, 12, 1, is_progressive));
    }
    const auto source = openSource({scratch.path("grey")}, {});
    EXPECT_EQ(source->info().dims, glm::ivec3(20, 12, 3));
    EXPECT_EQ(source->info().type, VoxelType::u8);
    const std::string all = readAll(*source);
    for (std::size_t i = 0; i < all.size(); ++i) {
      ASSERT_NEAR(static_cast<unsigned char>(all[i]), 10 + 100 * static_cast<int>(i / 240), 1) << i;
    }
  }
  std::string red;
  for (int i = 0; i < 64; ++i) red += std::string("\xc8\x10\x10", 3);
  const std::string file = jpegFile(red, 8, 8, 3, false);
  const auto color = openSource({scratch.write("red.jpeg", file)}, {});
  EXPECT_EQ(color->info().type, VoxelType::rgba8);
  const std::string pixel = readAll(*color).substr(0, 4);
  EXPECT_NEAR(static_cast<unsigned char>(pixel[0]), 0xc8, 3);
  EXPECT_NEAR(static_cast<unsigned char>(pixel[1]), 0x10, 3);
  EXPECT_EQ(pixel[0], pixel[3]) << "density is the largest colour";
}

TEST(Pictures, Jpeg2000KeepsEveryBit) {
  const Scratch scratch;
  std::mt19937 random(3);
  for (const unsigned bits : {1u, 8u, 12u, 16u, 20u}) {
    for (const bool is_signed : {false, true}) {
      if (bits == 1 && is_signed) continue;
      std::vector<int> values(7 * 5);
      const int range = 1 << bits;
      for (int& value : values)
        value = static_cast<int>(random() % static_cast<unsigned>(range)) - (is_signed ? range / 2 : 0);
      for (const bool is_bare : {false, true}) {
        const auto path = scratch.write("a.jp2", jpeg2000File(values, 7, 5, 1, bits, is_signed, is_bare));
        const auto source = openSource({path}, {});
        const SourceChannel& channel = source->info().channels[0];
        const std::string all = readAll(*source);
        const std::size_t width = voxelBytes(source->info().type);
        EXPECT_EQ(width, bits <= 8 ? 1u : bits <= 16 ? 2u : 4u);
        for (std::size_t i = 0; i < values.size(); ++i) {
          double stored = 0;
          if (source->info().type == VoxelType::f32) {
            float value = 0;
            std::memcpy(&value, &all[i * width], width);
            stored = static_cast<double>(value);
          } else {
            std::uint16_t value = 0;
            std::memcpy(&value, &all[i * width], width);
            stored = value;
          }
          ASSERT_EQ(channel.value_offset + channel.value_scale * stored, values[i]) << bits << " " << i;
        }
      }
    }
  }
  std::vector<int> colors;
  for (int i = 0; i < 6 * 4 * 3; ++i) colors.push_back(i);
  const auto color = openSource({scratch.write("b.jp2", jpeg2000File(colors, 6, 4, 3, 8, false))}, {});
  EXPECT_EQ(color->info().type, VoxelType::rgba8);
  EXPECT_EQ(readAll(*color).substr(4, 4), std::string("\x03\x04\x05\x05", 4));
}

// A palette behind the boxes that say what the picture is; colours that are no RGB.
TEST(Pictures, Jpeg2000WithAPaletteOrOtherColoursIsRefused) {
  const Scratch scratch;
  const auto with = [](std::string file, const std::string& boxes) {
    const std::size_t header = file.find("jp2h") - 4;
    const auto length = static_cast<std::size_t>(static_cast<unsigned char>(file[header + 2]) << 8 |
                                                 static_cast<unsigned char>(file[header + 3]));
    file.insert(header + length, boxes);
    file[header + 2] = static_cast<char>((length + boxes.size()) >> 8);
    file[header + 3] = static_cast<char>(length + boxes.size());
    return file;
  };
  const std::string palette("\0\0\0\x14pclr\0\2\3\7\7\7\x0a\x14\x1e\x28\x32\x3c", 20);
  const std::string map(
      "\0\0\0\x14"
      "cmap\0\0\1\0\0\0\1\1\0\0\1\2",
      20);
  const std::string indexed = jpeg2000File({0, 1, 1, 0, 0, 1}, 3, 2, 1, 8, false);
  EXPECT_THAT(refusal({scratch.write("a.jp2", with(indexed, palette + map))}), HasSubstr("it has a palette"));
  std::string cmyk = jpeg2000File(std::vector<int>(24, 9), 3, 2, 4, 8, false);
  const std::size_t color = cmyk.find("colr") + 4;
  cmyk[color + 6] = 12;  // the last byte of the colour space's number
  EXPECT_THAT(refusal({scratch.write("b.jp2", cmyk)}), HasSubstr("neither grey nor RGB"));
}

TEST(Pictures, WebpPicturesAndAnimationsAreSlices) {
  const Scratch scratch;
  const std::string rgb = randomBytes(9 * 6 * 3, 1);
  scratch.write("still.webp", webpFile(rgb, 9, 6, 3));
  const auto still = openSource({scratch.path("still.webp")}, {});
  EXPECT_EQ(still->info().dims, glm::ivec3(9, 6, 1));
  EXPECT_EQ(readAll(*still).substr(0, 3), rgb.substr(0, 3));
  std::vector<std::string> pictures;
  for (unsigned z = 0; z < 4; ++z) {
    std::string pixels = randomBytes(9 * 6 * 4, 10 + z);
    for (std::size_t i = 3; i < pixels.size(); i += 4) pixels[i] = (i + z) % 3 == 0 ? '\0' : '\xff';
    for (std::size_t i = 0; i < pixels.size(); i += 4) {
      if (pixels[i + 3] == '\0') pixels.replace(i, 4, 4, '\0');
    }
    pictures.push_back(pixels);
  }
  const auto film = openSource({scratch.write("film.webp", webpAnimation(pictures, 9, 6))}, {});
  ASSERT_EQ(film->info().dims, glm::ivec3(9, 6, 4));
  EXPECT_EQ(film->info().type, VoxelType::rgba8);
  std::string expected;
  for (const std::string& pixels : pictures) expected += pixels;
  EXPECT_TRUE(readAll(*film) == expected);
}

TEST(Pictures, GifPicturesAreWhatIsShown) {
  const Scratch scratch;
  const auto grey =
      openSource({scratch.write("grey.gif",
                                gifFile(3, 2, kGreys, {{0, 0, 3, 2, indices("012301")}, {1, 0, 2, 1, indices("33")}}))},
                 {});
  EXPECT_EQ(grey->info().dims, glm::ivec3(3, 2, 2));
  EXPECT_EQ(grey->info().type, VoxelType::u8);
  EXPECT_EQ(readAll(*grey), std::string("\x00\x5a\xb4\xff\x00\x5a\x00\xff\xff\xff\x00\x5a", 12));

  // Kept, cleared, restored; a transparent colour leaves what is below.
  const auto film = openSource({scratch.write("film.gif", gifFile(3, 2, kColors,
                                                                  {{0, 0, 3, 2, indices("111111"), DISPOSE_DO_NOT},
                                                                   {1, 0, 2, 2, indices("2323"), DISPOSE_PREVIOUS, 3},
                                                                   {0, 1, 3, 1, indices("333"), DISPOSE_BACKGROUND},
                                                                   {0, 0, 1, 1, indices("2"), DISPOSE_DO_NOT}}))},
                               {});
  ASSERT_EQ(film->info().dims, glm::ivec3(3, 2, 4));
  EXPECT_EQ(readAll(*film), rgba("111111") + rgba("121121") + rgba("111333") + rgba("211..."));

  std::string rows;
  for (int y = 0; y < 11; ++y) rows += std::string(2, static_cast<char>('0' + y % 4));
  const std::string interlaced = [&] {  // as a file has them
    std::string order;
    for (const auto& [first, step] : {std::pair{0, 8}, {4, 8}, {2, 4}, {1, 2}}) {
      for (int y = first; y < 11; y += step) order += rows.substr(2 * static_cast<std::size_t>(y), 2);
    }
    return order;
  }();
  const auto laced = openSource(
      {scratch.write("laced.gif", gifFile(2, 11, kColors, {{0, 0, 2, 11, indices(interlaced), 0, -1, true}}))}, {});
  const std::string all = readAll(*laced);
  const std::string expected = rgba(rows);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i % 4 < 3) {
      ASSERT_EQ(all[i], expected[i]) << i;
    }
  }
}

TEST(Pictures, AreRefusedByName) {
  const Scratch scratch;
  const std::string grey(64, 'x');
  scratch.write("mixed/a.jpg", jpegFile(grey, 8, 8, 1, false));
  scratch.write("mixed/b.jpg", jpegFile(grey, 4, 16, 1, false));
  EXPECT_THAT(refusal({scratch.path("mixed")}),
              HasSubstr("b.jpg: has 4 x 16 pixels of 1 x u8, the first slice has 8 x 8"));
  scratch.write("kinds/a.jpg", jpegFile(grey, 8, 8, 1, false));
  scratch.write("kinds/b.gif", gifFile(3, 2, kGreys, {{0, 0, 3, 2, indices("012301")}}));
  EXPECT_THAT(refusal({scratch.path("kinds")}), HasSubstr("holds slices of several kinds"));
  scratch.write("liar/a.jpg", "text");
  EXPECT_THAT(refusal({scratch.path("liar")}), HasSubstr("named like a slice"));
  const auto film = gifFile(3, 2, kGreys, {{0, 0, 3, 2, indices("012301")}, {1, 0, 2, 1, indices("33")}});
  scratch.write("films/a.gif", film);
  scratch.write("films/b.gif", film);
  EXPECT_THAT(refusal({scratch.path("films")}), HasSubstr("has 2 pictures; of several files each is one slice"));
  EXPECT_THAT(refusal({scratch.write("out.gif", gifFile(2, 2, kGreys, {{1, 1, 2, 2, indices("0123")}}))}),
              HasSubstr("lies outside the screen"));
  EXPECT_THAT(refusal({scratch.write("none.gif", gifFile(2, 2, kGreys, {}))}), HasSubstr("holds no picture"));
  ImportOptions tight;
  tight.memory_bytes = 1 << 20;
  const std::string large(1500 * 1500, 'x');
  EXPECT_THAT(refusal({scratch.write("large.jpg", jpegFile(large, 1500, 1500, 1, false))}, tight),
              HasSubstr("large.jpg: size: 1500 x 1500 pixels take 9000000 bytes to unpack"));
}

TEST(Pictures, SurviveBreaking) {
  const Scratch scratch;
  survivesBreaking(scratch, "a.jpg", jpegFile(randomBytes(16 * 16 * 3, 4), 16, 16, 3, false));
  survivesBreaking(scratch, "a.webp", webpFile(randomBytes(9 * 6 * 4, 4), 9, 6, 4));
  survivesBreaking(scratch, "b.webp", webpAnimation({randomBytes(64, 1), randomBytes(64, 2)}, 4, 4));
  survivesBreaking(scratch, "a.gif",
                   gifFile(3, 2, kColors, {{0, 0, 3, 2, indices("012301")}, {1, 0, 2, 1, indices("33"), 3, 3}}));
  std::vector<int> values(12 * 12);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<int>(i * 37 % 4096);
  survivesBreaking(scratch, "a.jp2", jpeg2000File(values, 12, 12, 1, 12, false));
}

}  // namespace
}  // namespace blockwalk
