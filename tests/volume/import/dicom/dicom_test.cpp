// SPDX-License-Identifier: Apache-2.0
#include "tests/volume/import/dicom/dicom_writer.h"

#include <turbojpeg.h>

#include "tests/volume/import/broken.h"
#include "volume/build/builder.h"
#include "volume/file/file.h"
#include "volume/import/dicom/dicom_frames.h"

namespace blockwalk {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::string wordsFrom(std::initializer_list<int> firsts) {
  std::vector<std::uint16_t> words;
  for (const int first : firsts) {
    for (int i = 0; i < 6; ++i) words.push_back(static_cast<std::uint16_t>(first + i));
  }
  return bytesOf(words);
}

TEST(ImportDicom, ReadsASeriesInTheOrderOfItsPlaces) {
  const Scratch scratch;
  for (const char* syntax : {"1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2"}) {
    scratch.write("s/c", slice("10\\20\\-3", 300, syntax).file());
    scratch.write("s/a", slice("10\\20\\-5", 100, syntax).file());
    scratch.write("s/b", slice("10\\20\\-1", 500, syntax).file());
    scratch.write("s/notes.txt", "no image");
    const auto source = openSource({scratch.path("s")}, {});
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.dims, glm::ivec3(3, 2, 3));
    EXPECT_EQ(readAll(*source), wordsFrom({100, 300, 500})) << syntax;
    EXPECT_EQ(worldOf(info, {0.5, 0.5, 0.5}), glm::dvec3(10, 20, -5));
    EXPECT_EQ(worldOf(info, {2.5, 1.5, 2.5}), glm::dvec3(10.5, 20.5, -1));
    EXPECT_EQ(info.space, "left-posterior-superior");
    EXPECT_EQ(info.length_unit, "mm");
    EXPECT_EQ(info.channels[0].value_scale, 2);
    EXPECT_EQ(info.channels[0].value_offset, -1000);
    EXPECT_EQ(info.channels[0].unit, "HU");
    EXPECT_THAT(info.notes, IsEmpty());
  }
  // Named one by one, and what is stored of it: nothing of a person.
  const auto named = openSource({scratch.path("s/b"), scratch.path("s/a"), scratch.path("s/c")}, {});
  EXPECT_EQ(readAll(*named), wordsFrom({100, 300, 500}));
  buildVolume(*named, scratch.path("v.bwv"), {});
  std::ifstream stream(scratch.path("v.bwv"), std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_THAT(bytes, Not(HasSubstr("Somebody")));
  EXPECT_THAT(bytes, HasSubstr("modality\tCT\n"));
  EXPECT_EQ(importAll(scratch.path("s/a")), wordsFrom({100}));
}

TEST(ImportDicom, TakesObliqueTiltedAndReversedSlices) {
  const Scratch scratch;
  const auto placed = [&](const char* name, const std::string& position, int first, const std::string& directions) {
    scratch.write(name, slice(position, first).text(0x00200037, "DS", directions).file());
  };
  // Rows along y, columns along -z: the normal is -x, so that slices ascend to the right.
  placed("o/1", "4\\0\\0", 100, "0\\1\\0\\0\\0\\-1");
  placed("o/2", "2\\0\\0", 200, "0\\1\\0\\0\\0\\-1");
  const auto oblique = openSource({scratch.path("o")}, {});
  EXPECT_EQ(readAll(*oblique), wordsFrom({100, 200}));
  EXPECT_EQ(worldOf(oblique->info(), {0.5, 0.5, 1.5}), glm::dvec3(2, 0, 0));
  EXPECT_EQ(worldOf(oblique->info(), {1.5, 1.5, 0.5}), glm::dvec3(4, 0.25, -0.5));
  EXPECT_GT(glm::determinant(glm::dmat3(oblique->info().world_from_index)), 0);
  // A tilted gantry: slices are shifted against each other.
  placed("t/1", "0\\0\\0", 100, "1\\0\\0\\0\\1\\0");
  placed("t/2", "0\\1\\3", 200, "1\\0\\0\\0\\1\\0");
  EXPECT_EQ(worldOf(openSource({scratch.path("t")}, {})->info(), {0.5, 0.5, 1.5}), glm::dvec3(0, 1, 3));
}

TEST(ImportDicom, TellsGapsDuplicatesAndStrangers) {
  const Scratch scratch;
  const auto put = [&](const std::string& name, const std::string& z, int first) {
    scratch.write(name, slice("0\\0\\" + z, first).file());
  };
  for (const char* z : {"0", "1", "2", "5", "6"}) put(std::string("g/") + z, z, 100);
  EXPECT_THAT(openSource({scratch.path("g")}, {})->info().notes,
              ElementsAre(HasSubstr("2 slices are missing, behind slice 3 of 5")));
  for (const char* z : {"0", "1", "2", "3.3"}) put(std::string("i/") + z, z, 100);
  EXPECT_THAT(openSource({scratch.path("i")}, {})->info().notes,
              ElementsAre(HasSubstr("1 slices are not as far apart")));
  for (const char* z : {"0", "1", "2"}) put(std::string("d/") + z, z, 100);
  put("d/again", "1", 700);
  const auto once = openSource({scratch.path("d")}, {});
  EXPECT_EQ(readAll(*once), wordsFrom({100, 100, 100}));
  EXPECT_THAT(once->info().notes, ElementsAre(HasSubstr("1 images lie where another one does")));
  // Each place twice: two volumes in time.
  for (const char* z : {"0", "1"}) {
    put(std::string("f/early") + z, z, 100);
    put(std::string("f/late") + z, z, 900);
  }
  ImportOptions late;
  late.frame = 1;
  EXPECT_EQ(importAll(scratch.path("f")), wordsFrom({100, 100}));
  EXPECT_EQ(importAll(scratch.path("f"), late), wordsFrom({900, 900}));
  put("s/1", "0", 100);
  put("s/2", "1", 200);
  scratch.write("s/scout", slice("0\\0\\0", 5).text(0x00200037, "DS", "1\\0\\0\\0\\0\\-1").file());
  const auto series = openSource({scratch.path("s")}, {});
  EXPECT_EQ(readAll(*series), wordsFrom({100, 200}));
  EXPECT_THAT(series->info().notes, ElementsAre(HasSubstr("1 images of another size, kind or direction")));
}

TEST(ImportDicom, ListsSeveralSeries) {
  const Scratch scratch;
  scratch.write("a", slice("0\\0\\0", 100).file());
  scratch.write("sub/b", slice("0\\0\\0", 200).text(0x0020000e, "UI", "1.2.4").text(0x00080060, "CS", "PT").file());
  EXPECT_THAT(refusal({scratch.path("")}),
              AllOf(HasSubstr("holds 2 series"), HasSubstr("--series 1: CT of 3 x 2, 1 files, 1.2.3"),
                    HasSubstr("--series 2: PT of 3 x 2, 1 files, 1.2.4")));
  ImportOptions options;
  for (const char* second : {"2", "1.2.4"}) {
    options.series = second;
    EXPECT_EQ(importAll(scratch.path(""), options), wordsFrom({200}));
  }
  options.series = "3";
  EXPECT_THAT(refusal({scratch.path("")}, options), HasSubstr("--series 3: there is no such series"));
}

TEST(ImportDicom, TakesBitsSignsAndColours) {
  const Scratch scratch;
  const auto stored = [&](const DicomWriter& writer) { return importAll(scratch.write("a.dcm", writer.file())); };
  // 12 of 16 bits; what lies in the others is an overlay.
  auto twelve = slice("0\\0\\0", 0).whole(0x00280101, 12).whole(0x00280102, 11);
  EXPECT_EQ(stored(twelve.pixels(bytesOf<std::uint16_t>({0xf001, 0x0fff, 0x8000, 3, 4, 5}))),
            bytesOf<std::uint16_t>({1, 0xfff, 0, 3, 4, 5}));
  twelve.whole(0x00280103, 1);
  EXPECT_EQ(stored(twelve.pixels(bytesOf<std::uint16_t>({0xffff, 0x0800, 0x07ff, 3, 4, 5}))),
            bytesOf<std::uint16_t>({32767, 32768 - 2048, 32768 + 2047, 32771, 32772, 32773}));
  auto inverted = slice("0\\0\\0", 0).text(0x00280004, "CS", "MONOCHROME1").whole(0x00280101, 12).whole(0x00280102, 11);
  EXPECT_EQ(stored(inverted), bytesOf<std::uint16_t>({4095, 4094, 4093, 4092, 4091, 4090}));
  EXPECT_THAT(openSource({scratch.path("a.dcm")}, {})->info().notes, ElementsAre(HasSubstr("MONOCHROME1")));
  const auto color = [&](const char* photometric, int planar, const std::string& bytes) {
    auto writer = slice("0\\0\\0", 0);
    writer.whole(0x00280002, 3).text(0x00280004, "CS", photometric).whole(0x00280006, planar).whole(0x00280010, 1);
    writer.whole(0x00280011, 2).whole(0x00280100, 8).whole(0x00280101, 8).whole(0x00280102, 7);
    return stored(writer.pixels(bytes));
  };
  EXPECT_EQ(color("RGB", 0, "\x01\x02\x03\x04\x05\x06"), std::string("\x01\x02\x03\x03\x04\x05\x06\x06"));
  EXPECT_EQ(color("RGB", 1, "\x01\x04\x02\x05\x03\x06"), std::string("\x01\x02\x03\x03\x04\x05\x06\x06"));
  EXPECT_EQ(color("YBR_FULL", 0, "\x4c\x55\xff\x96\x2c\x15"), std::string("\xfe\0\0\xfe\0\xff\x01\xff", 8));
  // A frame a scale: what is stored are values.
  scratch.write("p/1", slice("0\\0\\0", 10).file());
  scratch.write("p/2", slice("0\\0\\1", 20).text(0x00281053, "DS", "-0.5").file());
  EXPECT_EQ(importAll(scratch.path("p")),
            bytesOf<float>({-980, -978, -976, -974, -972, -970, -1010, -1010.5f, -1011, -1011.5f, -1012, -1012.5f}));
  const auto falling =
      openSource({scratch.write("f.dcm", slice("0\\0\\0", 10).text(0x00281053, "DS", "-2").file())}, {});
  EXPECT_EQ(falling->info().channels[0].value_scale, 2);
  EXPECT_EQ(falling->info().channels[0].value_offset + 2 * (65535 - 10), -1020);
}

TEST(ImportDicom, ReadsFramesOfOneFile) {
  const Scratch scratch;
  auto writer = slice("0\\0\\7", 0);
  writer.text(0x00280008, "IS", "3").text(0x00180088, "DS", "2").pixels(wordsFrom({100, 200, 300}));
  const auto plain = openSource({scratch.write("m.dcm", writer.file())}, {});
  EXPECT_EQ(readAll(*plain), wordsFrom({100, 200, 300}));
  EXPECT_EQ(worldOf(plain->info(), {0.5, 0.5, 2.5}), glm::dvec3(0, 0, 11));
  writer.text(0x3004000c, "DS", "0\\3\\6");
  EXPECT_EQ(worldOf(openSource({scratch.write("d.dcm", writer.file())}, {})->info(), {0.5, 0.5, 2.5}),
            glm::dvec3(0, 0, 13));
  // Enhanced: what all have in common, and what each frame says of itself, not in order.
  for (const char* syntax : {"1.2.840.10008.1.2", "1.2.840.10008.1.2.1"}) {
    const auto set = [&](const std::function<void(DicomWriter&)>& fill) {
      DicomWriter item(syntax);
      fill(item);
      return item.set();
    };
    const auto frame = [&](const char* position) {
      return set([&](DicomWriter& item) {
        item.sequence(0x00209113, {set([&](DicomWriter& place) { place.text(0x00200032, "DS", position); })});
      });
    };
    const std::string shared = set([&](DicomWriter& item) {
      item.sequence(0x00209116, {set([](DicomWriter& plane) { plane.text(0x00200037, "DS", "1\\0\\0\\0\\1\\0"); })});
      item.sequence(0x00289110, {set([](DicomWriter& size) { size.text(0x00280030, "DS", "0.5\\0.75"); })});
      item.sequence(0x00289145, {set([](DicomWriter& values) {
                      values.text(0x00281052, "DS", "-7").text(0x00281053, "DS", "3").text(0x00281054, "LO", "mGy");
                    })});
    });
    auto enhanced = slice("0\\0\\0", 0, syntax);
    for (const std::uint32_t tag : {0x00200032u, 0x00200037u, 0x00280030u, 0x00281052u, 0x00281053u})
      enhanced.without(tag);
    enhanced.text(0x00280008, "IS", "3").pixels(wordsFrom({300, 100, 200}));
    enhanced.sequence(0x52009229, {shared})
        .sequence(0x52009230, {frame("0\\0\\9"), frame("0\\0\\1"), frame("0\\0\\5")});
    const auto source = openSource({scratch.write("e.dcm", enhanced.file())}, {});
    EXPECT_EQ(readAll(*source), wordsFrom({100, 200, 300}));
    EXPECT_EQ(worldOf(source->info(), {1.5, 1.5, 1.5}), glm::dvec3(0.75, 0.5, 5));
    EXPECT_EQ(source->info().channels[0].value_scale, 3);
    EXPECT_EQ(source->info().channels[0].value_offset, -7);
    EXPECT_EQ(source->info().channels[0].unit, "mGy");
  }
}

// Two segments a word: literal runs and repeated ones.
std::string rleOf(const std::string& words) {
  std::string high;
  std::string low;
  for (std::size_t i = 0; i < words.size(); i += 2) {
    low += words[i];
    high += words[i + 1];
  }
  const std::string first = std::string(1, static_cast<char>(1 - static_cast<int>(high.size()))) + high[0];
  const std::string second = std::string(1, static_cast<char>(low.size() - 1)) + low + '\0';
  const std::uint32_t begin = 64 + static_cast<std::uint32_t>(first.size());
  std::vector<std::uint32_t> header(16);
  header[0] = 2;
  header[1] = 64;
  header[2] = begin;
  return bytesOf(header) + first + second;
}

TEST(ImportDicom, UnpacksRunsAndJpeg) {
  const Scratch scratch;
  auto runs = slice("0\\0\\0", 0, "1.2.840.10008.1.2.5");
  const std::string packed = rleOf(wordsFrom({300}));
  runs.fragments({packed});
  EXPECT_EQ(importAll(scratch.write("r.dcm", runs.file())), wordsFrom({300}));
  runs.text(0x00280008, "IS", "2").fragments({packed, rleOf(wordsFrom({320}))});
  EXPECT_EQ(importAll(scratch.write("r.dcm", runs.file())), wordsFrom({300, 320}));
  runs.text(0x00280008, "IS", "1").fragments({packed.substr(0, packed.size() - 5)});
  EXPECT_THAT(refusal({scratch.write("r.dcm", runs.file())}), HasSubstr("segment 1 of a frame has"));

  constexpr int kSide = 16;
  const auto jpeg = [&](TJPF format, int samples, const std::string& pixels) {
    tjhandle handle = tjInitCompress();
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    tjCompress2(handle, reinterpret_cast<const unsigned char*>(pixels.data()), kSide, 0, kSide, format, &bytes, &size,
                samples == 1 ? TJSAMP_GRAY : TJSAMP_422, 100, TJFLAG_ACCURATEDCT);
    std::string result(reinterpret_cast<const char*>(bytes), size);
    tjFree(bytes);
    tjDestroy(handle);
    if (result.size() % 2 == 1) result += '\0';
    auto writer = slice("0\\0\\0", 0, "1.2.840.10008.1.2.4.50");
    writer.whole(0x00280010, kSide).whole(0x00280011, kSide).whole(0x00280002, samples);
    writer.whole(0x00280100, 8).whole(0x00280101, 8).whole(0x00280102, 7);
    if (samples == 3) writer.text(0x00280004, "CS", "YBR_FULL_422").whole(0x00280006, 0);
    // In two fragments, as long frames are.
    return writer.fragments({result.substr(0, 100), result.substr(100)});
  };
  std::string grey;
  std::string colors;
  for (int i = 0; i < kSide * kSide; ++i) {
    grey += static_cast<char>(i % kSide * 12);
    colors += i / kSide < 8 ? std::string("\xf0\x20\x10", 3) : std::string("\x10\x30\xe0", 3);
  }
  const auto file = scratch.write("j.dcm", jpeg(TJPF_GRAY, 1, grey).file());
  if (!canUnpackDicom("1.2.840.10008.1.2.4.50")) {
    EXPECT_THAT(refusal({file}), HasSubstr("built without GDCM"));
    return;
  }
  const auto near = [](const std::string& found, const std::string& expected, std::size_t found_width,
                       std::size_t width) {
    int most = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const auto there = static_cast<unsigned char>(found[i / width * found_width + i % width]);
      most = std::max(most, std::abs(there - static_cast<unsigned char>(expected[i])));
    }
    return most;
  };
  EXPECT_LE(near(importAll(file), grey, 1, 1), 2);
  EXPECT_LE(near(importAll(scratch.write("c.dcm", jpeg(TJPF_RGB, 3, colors).file())), colors, 4, 3), 6);
  // What is broken in the codec's data is an error and goes no further.
  auto broken = jpeg(TJPF_GRAY, 1, grey);
  EXPECT_THAT(refusal({scratch.write("b.dcm", broken.fragments({std::string(200, 'x')}).file())}),
              HasSubstr("cannot be unpacked"));
}

TEST(ImportDicom, NamesTheElementThatIsWrong) {
  const Scratch scratch;
  const auto plain = [] { return slice("0\\0\\0", 0); };
  const std::pair<std::string, const char*> cases[] = {
      {plain().without(0x00280010).file(), "Rows: the element is missing"},
      {plain().whole(0x00280010, 0).file(), "Rows: 0 is outside"},
      {plain().whole(0x00280010, 3).file(), "PixelData: 12 bytes are there"},
      {plain().whole(0x00280100, 12).file(), "BitsAllocated: 12"},
      {plain().whole(0x00280101, 17).file(), "BitsStored: 17 is outside"},
      {plain().whole(0x00280102, 3).file(), "HighBit: 3 is outside"},
      {plain().text(0x00280004, "CS", "PALETTE COLOR").file(),
       "RedPaletteColorLookupTableDescriptor: 0 numbers, not 3"},
      {plain().text(0x00200032, "DS", "0\\0").file(), "ImagePositionPatient: 2 numbers, not 3"},
      {plain().text(0x00200032, "DS", "0\\0\\x").file(), "'x' is no finite number"},
      {plain().text(0x00200037, "DS", "1\\0\\0\\1\\0\\0").file(), "do not span a plane"},
      {plain().text(0x00280030, "DS", "0\\1").file(), "PixelSpacing: 0 and 1 must be above 0"},
      {plain().text(0x00280008, "IS", "70000").file(), "NumberOfFrames: 70000"},
      {plain().text(0x00281053, "DS", "0").file(), "RescaleSlope: 0"},
      {plain().without(0x7fe00010).file(), "no file of it has any"},
      {slice("0\\0\\0", 0, "1.2.840.10008.1.2.4.100").file(), "1.2.840.10008.1.2.4.100 cannot be read"},
  };
  for (const auto& [bytes, message] : cases) EXPECT_THAT(refusal({scratch.write("a.dcm", bytes)}), HasSubstr(message));
  ImportOptions little;
  little.memory_bytes = 20;
  EXPECT_THAT(refusal({scratch.write("a.dcm", plain().file())}, little), HasSubstr("--memory"));
}

TEST(ImportDicom, SurvivesCutsAndFlippedBits) {
  const Scratch scratch;
  auto runs = slice("0\\0\\0", 0, "1.2.840.10008.1.2.5");
  runs.fragments({rleOf(wordsFrom({300}))});
  DicomWriter item;
  item.text(0x00280030, "DS", "0.5\\0.75");
  DicomWriter group;
  group.sequence(0x00289110, {item.set()});
  for (const std::string& whole : {slice("0\\0\\0", 9).sequence(0x52009229, {group.set()}).file(), runs.file()}) {
    const auto right = importAll(scratch.write("w.dcm", whole));
    const auto outcome = [&](const std::string& bytes) {
      try {
        return importAll(scratch.write("x.dcm", bytes));
      } catch (const DataError&) {
        return std::string();
      }
    };
    forEachCut(whole, [&](const std::string& cut) {
      const std::string found = outcome(cut);
      EXPECT_TRUE(found.empty() || found == right) << cut.size();
    });
    int same = 0;
    forEachFlippedBit(whole,
                      [&](const std::string& broken) { same += outcome(broken).size() == right.size() ? 1 : 0; });
    EXPECT_GT(same, 300);
  }
}

}  // namespace
}  // namespace blockwalk
