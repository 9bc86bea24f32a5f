// SPDX-License-Identifier: Apache-2.0
#include <png.h>
#include <sys/stat.h>

#include <functional>

#include "tests/volume/import/import_scratch.h"
#include "volume/import/slices/slice_order.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

struct PngKind {
  int color_type = PNG_COLOR_TYPE_GRAY;
  int bit_depth = 8;
  int interlace = PNG_INTERLACE_NONE;
};

void appendBytes(png_structp png, png_bytep bytes, png_size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<char*>(bytes), count);
}

// `rows` as PNG has them: packed bits, 16-bit samples with the high byte first.
std::string pngOf(int width, int height, const PngKind& kind, std::string rows) {
  std::string file;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(png, &file, appendBytes, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), kind.bit_depth,
               kind.color_type, kind.interlace, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (kind.color_type == PNG_COLOR_TYPE_PALETTE) {
    const png_color colors[] = {{1, 2, 3}, {40, 50, 60}, {0, 0, 0}, {255, 254, 253}};
    const png_byte alphas[] = {0, 128};
    png_set_PLTE(png, info, colors, 4);
    png_set_tRNS(png, info, alphas, 2, nullptr);
  }
  png_write_info(png, info);
  const std::size_t row_bytes = rows.size() / static_cast<std::size_t>(height);
  std::vector<png_bytep> pointers;
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    pointers.push_back(reinterpret_cast<png_bytep>(&rows[y * row_bytes]));
  }
  png_write_image(png, pointers.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return file;
}

std::string counted(std::size_t count) {
  std::string bytes(count, '\0');
  for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<char>(i * 37 + 11);
  return bytes;
}

TEST(ImportPng, ReadsGreyAndColour) {
  const Scratch scratch;
  const std::string grey = counted(12);
  EXPECT_EQ(importAll(scratch.write("a", pngOf(4, 3, {}, grey))), grey);
  const std::string rgba = counted(48);
  EXPECT_EQ(importAll(scratch.write("b", pngOf(4, 3, {PNG_COLOR_TYPE_RGBA}, rgba))), rgba);
  const std::string wide = counted(24);
  EXPECT_EQ(importAll(scratch.write("c", pngOf(4, 3, {PNG_COLOR_TYPE_GRAY, 16}, wide))), swapped(wide, 2));
  EXPECT_EQ(importAll(scratch.write("d", pngOf(2, 1, {PNG_COLOR_TYPE_GRAY_ALPHA},
                                               "ab"
                                               "cd"))),
            "aaabcccd");
  EXPECT_EQ(importAll(scratch.write("e", pngOf(1, 1, {PNG_COLOR_TYPE_RGB}, std::string("\0\xff\0", 3)))),
            bytesOf<std::uint8_t>({0, 255, 0, 255}));
}

TEST(ImportPng, KeepsTheNumbersOfSmallSamples) {
  const Scratch scratch;
  EXPECT_EQ(importAll(scratch.write("a", pngOf(3, 1, {PNG_COLOR_TYPE_GRAY, 1}, "\xa0"))),
            bytesOf<std::uint8_t>({1, 0, 1}));
  EXPECT_EQ(importAll(scratch.write("b", pngOf(3, 1, {PNG_COLOR_TYPE_GRAY, 4}, "\x0f\x70"))),
            bytesOf<std::uint8_t>({0, 15, 7}));
  EXPECT_EQ(importAll(scratch.write("c", pngOf(4, 1, {PNG_COLOR_TYPE_PALETTE, 2}, "\x1b"))),
            bytesOf<std::uint8_t>({1, 2, 3, 0, 40, 50, 60, 128, 0, 0, 0, 255, 255, 254, 253, 255}));
}

TEST(ImportPng, RoundsWideColourAndSaysSo) {
  const Scratch scratch;
  const auto file = scratch.write(
      "a", pngOf(1, 1, {PNG_COLOR_TYPE_RGBA, 16}, swapped(bytesOf<std::uint16_t>({0, 65535, 257 * 7, 128}), 2)));
  const auto source = openSource({file}, {});
  EXPECT_EQ(readAll(*source), bytesOf<std::uint8_t>({0, 255, 7, 0}));
  EXPECT_NEAR(source->conversion(0).largest_rounding, 128.0 * 255 / 65535, 1e-9);
}

TEST(ImportPng, ReadsInterlacedImagesWithinMemory) {
  const Scratch scratch;
  const std::string pixels = counted(40 * 30);
  const auto file = scratch.write("a", pngOf(40, 30, {PNG_COLOR_TYPE_GRAY, 8, PNG_INTERLACE_ADAM7}, pixels));
  EXPECT_EQ(importAll(file), pixels);
  ImportOptions options;
  options.memory_bytes = 1000;
  EXPECT_THAT(refusal({file}, options), HasSubstr("--memory"));
}

TEST(ImportPng, StacksSlicesInNaturalOrder) {
  const Scratch scratch;
  for (int i : {10, 2, 1}) {
    scratch.write("stack/slice" + std::to_string(i) + ".png",
                  pngOf(2, 2, {}, std::string(4, static_cast<char>('a' + i))));
  }
  scratch.write("stack/notes.txt", "not a slice");
  const auto source = openSource({scratch.path("stack")}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(2, 2, 3));
  EXPECT_EQ(readAll(*source), "bbbbcccckkkk");
  EXPECT_EQ(source->info().name, "stack");
  const auto named = openSource({scratch.path("stack/slice10.png"), scratch.path("stack/slice2.png")}, {});
  EXPECT_EQ(readAll(*named), "cccckkkk");
  scratch.write("stack/slice3.png", pngOf(2, 3, {}, std::string(6, 'x')));
  EXPECT_THAT(refusal({scratch.path("stack")}), HasSubstr("slice3.png"));
  scratch.write("stack/slice3.png", "this is no picture");
  EXPECT_THAT(refusal({scratch.path("stack")}), HasSubstr("slice3.png"));
  EXPECT_THAT(refusal({scratch.path("stack/slice1.png"), scratch.path("stack/slice1.png")}), HasSubstr("twice"));
  EXPECT_THAT(refusal({scratch.path("stack/slice1.png"), scratch.path("stack/notes.txt")}), HasSubstr("notes.txt"));
  std::filesystem::create_directory(scratch.path("bare"));
  EXPECT_THAT(refusal({scratch.path("bare")}), HasSubstr("holds no slices"));
}

TEST(ImportPng, CutsTilesInRowOrder) {
  const Scratch scratch;
  // 2 x 2 tiles of 2 x 1, then 1 x 3 tiles of 4 x 1
  const auto file = scratch.write("a", pngOf(4, 3, {}, "aabbccddeeff"));
  ImportOptions options;
  options.dims = glm::ivec3(2, 1, 5);
  EXPECT_EQ(importAll(file, options), "aabbccddee");
  options.dims = glm::ivec3(4, 1, 3);
  EXPECT_EQ(importAll(file, options), "aabbccddeeff");
  options.dims = glm::ivec3(2, 3, 2);
  EXPECT_EQ(importAll(file, options),
            "aaccee"
            "bbddff");
  options.dims = glm::ivec3(3, 1, 3);
  EXPECT_THAT(refusal({file}, options), HasSubstr("do not divide"));
  options.dims = glm::ivec3(2, 1, 7);
  EXPECT_THAT(refusal({file}, options), HasSubstr("6 tiles, 7"));
}

TEST(ImportPng, RefusesEveryCutAndHugeClaims) {
  const Scratch scratch;
  const std::string whole = pngOf(9, 7, {PNG_COLOR_TYPE_RGB}, counted(9 * 7 * 3));
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_FALSE(refusal({scratch.write("cut", whole.substr(0, length))}).empty()) << length;
  }
  std::string huge = pngOf(1, 1, {}, "x");
  huge.replace(16, 8, std::string("\x7f\xff\xff\xff\x7f\xff\xff\xff", 8));
  EXPECT_FALSE(refusal({scratch.write("huge", huge)}).empty());
}

TEST(SliceOrder, IsNaturalAndStrict) {
  const std::vector<std::string> ordered = {
      "a", "a1", "a01b", "a2", "a10", "a10b", "a11", "b", "b00100000000000000000000", "b00200000000000000000000"};
  for (std::size_t i = 0; i < ordered.size(); ++i) {
    for (std::size_t j = 0; j < ordered.size(); ++j) {
      EXPECT_EQ(comesBefore(ordered[i], ordered[j]), i < j) << ordered[i] << " " << ordered[j];
    }
  }
}

TEST(ImportPng, AFolderPassesOverNoSlice) {
  const Scratch scratch;
  const std::string slice = pngOf(2, 2, {}, "abcd");
  scratch.write("stack/a.png", slice);
  scratch.write("stack/c.png", slice);
  scratch.write("stack/notes.txt", "not a slice");
  scratch.write("stack/.b.png", "hidden");
  scratch.write("stack/deeper/d.png", slice);
  std::filesystem::create_symlink("a.png", scratch.path("stack/b.png"));
  EXPECT_EQ(importAll(scratch.path("stack")), "abcdabcdabcd") << "a link to a slice is one";

  const auto odd = scratch.path("stack/b2.TIF");
  const std::pair<std::string, std::function<void()>> makers[] = {
      {"a pipe, a socket or a device", [&] { ASSERT_EQ(mkfifo(odd.c_str(), 0600), 0); }},
      {"a pipe, a socket or a device", [&] { ASSERT_EQ(mknod(odd.c_str(), S_IFSOCK | 0600, 0), 0); }},
      {"a folder", [&] { std::filesystem::create_directory(odd); }},
      {"a folder", [&] { std::filesystem::create_symlink("deeper", odd); }},
      {"a link that leads nowhere", [&] { std::filesystem::create_symlink("absent.png", odd); }},
      {"a link that leads nowhere", [&] { std::filesystem::create_symlink("b2.TIF", odd); }},
  };
  for (const auto& [says, make] : makers) {
    make();
    EXPECT_THAT(refusal({scratch.path("stack")}), testing::AllOf(HasSubstr("b2.TIF"), HasSubstr(says)));
    std::filesystem::remove(odd);
  }
}

}  // namespace
}  // namespace blockwalk
