// SPDX-License-Identifier: Apache-2.0
#include "tests/volume/import/broken.h"
#include "tests/volume/import/dicom/dicom_writer.h"
#include "volume/build/builder.h"
#include "volume/file/file.h"

namespace blockwalk {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Segment {
  int number = 1;
  std::string name = "";
  std::vector<int> lab = {};
};

struct SegmentFrame {
  int segment = 1;
  std::string position = "0\\0\\0";
  std::string pixels = "";  // 3 x 2, '#' where the segment is
};

std::string setOf(const std::function<void(DicomWriter&)>& fill) {
  DicomWriter item;
  fill(item);
  return item.set();
}

class SegmentWriter {
 public:
  SegmentWriter(const std::vector<Segment>& segments, const std::vector<SegmentFrame>& frames,
                const char* syntax = "1.2.840.10008.1.2.1")
      : file_(slice("0\\0\\0", 0, syntax)) {
    for (const std::uint32_t tag : {0x00200032u, 0x00200037u, 0x00280030u, 0x00281052u, 0x00281053u}) {
      file_.without(tag);
    }
    file_.text(0x00080060, "CS", "SEG").text(0x00620001, "CS", "BINARY");
    file_.whole(0x00280100, 1).whole(0x00280101, 1).whole(0x00280102, 0);
    file_.text(0x00280008, "IS", std::to_string(frames.size()));
    std::vector<std::string> items;
    for (const Segment& segment : segments) {
      items.push_back(setOf([&](DicomWriter& item) {
        item.whole(0x00620004, segment.number).text(0x00620005, "LO", segment.name);
        if (!segment.lab.empty()) item.wholes(0x0062000d, segment.lab);
      }));
    }
    file_.sequence(0x00620002, items);
    describePlanes("0.5\\0.25", "2");
    std::vector<std::string> groups;
    std::string bits;
    for (const SegmentFrame& frame : frames) {
      bits += frame.pixels;
      groups.push_back(setOf([&](DicomWriter& group) {
        if (!frame.position.empty()) {
          group.sequence(0x00209113,
                         {setOf([&](DicomWriter& place) { place.text(0x00200032, "DS", frame.position); })});
        }
        group.sequence(0x0062000a, {setOf([&](DicomWriter& id) { id.whole(0x0062000b, frame.segment); })});
      }));
    }
    file_.sequence(0x52009230, groups);
    std::string packed((bits.size() + 7) / 8, '\0');
    for (std::size_t i = 0; i < bits.size(); ++i) {
      if (bits[i] == '#') packed[i / 8] = static_cast<char>(packed[i / 8] | 1 << i % 8);
    }
    file_.bytes(0x7fe00010, "OB", packed);
  }

  // Shared by all frames; no step where it is empty.
  void describePlanes(const std::string& spacing, const std::string& step) {
    const std::string plane = setOf([](DicomWriter& item) { item.text(0x00200037, "DS", "1\\0\\0\\0\\1\\0"); });
    const std::string measures = setOf([&](DicomWriter& item) {
      item.text(0x00280030, "DS", spacing).text(0x00180050, "DS", "9");
      if (!step.empty()) item.text(0x00180088, "DS", step);
    });
    file_.sequence(
        0x52009229,
        {setOf([&](DicomWriter& group) { group.sequence(0x00209116, {plane}).sequence(0x00289110, {measures}); })});
  }

  DicomWriter& file() { return file_; }

 private:
  DicomWriter file_;
};

std::string labels(const std::string& digits) {
  std::string all;
  for (const char digit : digits) all += static_cast<char>(digit - '0');
  return all;
}

const std::vector<Segment> kTwo = {{1, "Liver", {35577, 53662, 50858}}, {2, "Spleen"}};

TEST(ImportDicomSegments, AreLabelsWhereTheyLie) {
  const Scratch scratch;
  for (const char* syntax : {"1.2.840.10008.1.2.1", "1.2.840.10008.1.2.1.99"}) {
    // Not in order, none at 12, two at 10.
    SegmentWriter writer(kTwo, {{2, "1\\2\\14", "....##"}, {1, "1\\2\\10", "##...."}, {2, "1\\2\\10", "...#.."}},
                         syntax);
    const auto source = openSource({scratch.write("s.dcm", writer.file().file())}, {});
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.dims, glm::ivec3(3, 2, 3));
    EXPECT_EQ(info.type, VoxelType::u8);
    EXPECT_EQ(readAll(*source), labels("110200"
                                       "000000"
                                       "000022"));
    EXPECT_EQ(worldOf(info, {0.5, 0.5, 0.5}), glm::dvec3(1, 2, 10));
    EXPECT_EQ(worldOf(info, {1.5, 1.5, 2.5}), glm::dvec3(1.25, 2.5, 14));
    EXPECT_EQ(info.space, "left-posterior-superior");
    EXPECT_EQ(info.length_unit, "mm");
    EXPECT_THAT(info.notes, IsEmpty());
    ASSERT_EQ(info.channels.size(), 1u);
    EXPECT_TRUE(info.channels[0].is_labels);
    const auto& named = info.channels[0].labels;
    ASSERT_EQ(named.size(), 2u);
    EXPECT_EQ(named[0].name, "Liver");
    EXPECT_EQ(named[0].color, (Color{255, 0, 0})) << "L* 54.29, a* 80.80, b* 69.89 of D50";
    EXPECT_EQ(named[1].name, "Spleen");
    EXPECT_EQ(named[1].value, 2);
    EXPECT_EQ(named[1].color, std::nullopt);
    // As far as the file.
    buildVolume(*source, scratch.path("v.bwv"), {.values = ValuesRule::guess});
    const VolumeFile file(scratch.path("v.bwv"));
    EXPECT_EQ(file.info().channels[0].values, ChannelValues::labels);
    ASSERT_EQ(file.info().channels[0].labels.size(), 2u);
    EXPECT_EQ(file.info().channels[0].labels[1].name, "Spleen");
  }
}

TEST(ImportDicomSegments, AreAsFarApartAsIsSaidOrAsTheNearest) {
  const Scratch scratch;
  const auto depth = [&](const std::string& step, const std::vector<const char*>& places,
                         std::vector<std::string> notes = {}) {
    std::vector<SegmentFrame> frames;
    for (const char* z : places) frames.push_back({1, std::string("0\\0\\") + z, "#....."});
    SegmentWriter writer(kTwo, frames);
    writer.describePlanes("1\\1", step);
    const auto source = openSource({scratch.write("s.dcm", writer.file().file())}, {});
    EXPECT_EQ(source->info().notes.size(), notes.size());
    for (std::size_t i = 0; i < notes.size(); ++i) EXPECT_THAT(source->info().notes[i], HasSubstr(notes[i]));
    return glm::dvec2(source->info().dims.z, source->info().world_from_index[2][2]);
  };
  EXPECT_EQ(depth("2", {"0", "4", "10"}), glm::dvec2(6, 2));
  EXPECT_EQ(depth("", {"0", "4", "12"}), glm::dvec2(4, 4)) << "a thickness is no step";
  EXPECT_EQ(depth("2", {"0", "3", "9"}), glm::dvec2(4, 3)) << "what is said does not fit";
  EXPECT_EQ(depth("2", {"0"}), glm::dvec2(1, 2));
  EXPECT_EQ(depth("", {"0"}), glm::dvec2(1, 9));
  EXPECT_NEAR(depth("", {"0", "0.703", "1.406", "2.110"}).y, 2.110 / 3, 1e-12);
  EXPECT_EQ(depth("", {"0", "2", "7"}, {"1 of 3 frames do not lie whole slices"}).x, 5);
  std::vector<SegmentFrame> far = {{1, "0\\0\\0", "#....."}, {1, "0\\0\\1", "#....."}, {1, "0\\0\\90000", "#....."}};
  EXPECT_THAT(refusal({scratch.write("f.dcm", SegmentWriter(kTwo, far).file().file())}),
              HasSubstr("ImagePositionPatient: frames are 1 mm apart or more"));
}

TEST(ImportDicomSegments, ThatOverlapAreTold) {
  const Scratch scratch;
  SegmentWriter writer(kTwo, {{2, "0\\0\\0", "##...."}, {1, "0\\0\\0", "###..."}, {1, "0\\0\\2", "#....."}});
  const auto path = scratch.write("s.dcm", writer.file().file());
  const auto source = openSource({path}, {});
  EXPECT_EQ(readAll(*source), labels("221000"
                                     "100000"));
  EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("segments overlap in 2 voxels of 1 slices")));
  ImportOptions one;
  for (const char* chosen : {"Liver", "1"}) {
    one.dataset = chosen;
    const auto liver = openSource({path}, one);
    EXPECT_EQ(readAll(*liver), labels("111000"
                                      "100000"));
    EXPECT_THAT(liver->info().notes, IsEmpty());
    EXPECT_EQ(liver->info().channels[0].labels.size(), 1u);
  }
  one.dataset = "Kidney";
  EXPECT_THAT(refusal({path}, one),
              AllOf(HasSubstr("--dataset Kidney: there is no such segment"), HasSubstr("--dataset 2: Spleen")));
  EXPECT_THAT(refusal({scratch.write("ct.dcm", slice("0\\0\\0", 1).file())}, one),
              HasSubstr("of DICOM only segmentations"));
}

TEST(ImportDicomSegments, MayBeManyFractionsOrMaps) {
  const Scratch scratch;
  SegmentWriter many({{1, "a"}, {300, "b"}}, {{300, "0\\0\\0", "##...."}, {1, "0\\0\\2", "#....."}});
  const auto wide = openSource({scratch.write("s.dcm", many.file().file())}, {});
  EXPECT_EQ(wide->info().type, VoxelType::u16);
  EXPECT_EQ(readAll(*wide), bytesOf<std::uint16_t>({300, 300, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0}));

  SegmentWriter fraction(kTwo, {{1, "0\\0\\0", ""}, {2, "0\\0\\2", ""}});
  fraction.file().text(0x00620001, "CS", "FRACTIONAL").whole(0x0062000e, 100);
  fraction.file().whole(0x00280100, 8).whole(0x00280101, 8).whole(0x00280102, 7);
  fraction.file().bytes(0x7fe00010, "OB", "abcdefghijkl");
  const auto parts = openSource({scratch.write("f.dcm", fraction.file().file())}, {});
  ASSERT_EQ(parts->info().channels.size(), 2u);
  EXPECT_EQ(parts->info().channels[0].name, "Liver");
  EXPECT_EQ(parts->info().channels[0].value_scale, 0.01);
  EXPECT_FALSE(parts->info().channels[0].is_labels);
  const std::string none(6, '\0');
  EXPECT_EQ(readAll(*parts), "abcdef" + none + none + "ghijkl");

  SegmentWriter map({{0, "Background"}, {7, "Liver"}}, {{1, "0\\0\\0", ""}, {1, "0\\0\\2", ""}});
  map.file().text(0x00620001, "CS", "LABELMAP").whole(0x00280100, 8).whole(0x00280101, 8).whole(0x00280102, 7);
  map.file().bytes(0x7fe00010, "OB",
                   labels("077770"
                          "000700"));
  const auto labelled = openSource({scratch.write("m.dcm", map.file().file())}, {});
  EXPECT_EQ(readAll(*labelled), labels("077770"
                                       "000700"));
  EXPECT_EQ(labelled->info().channels[0].labels.size(), 2u);
}

TEST(ImportDicomSegments, NameWhatIsWrong) {
  const Scratch scratch;
  const auto refused = [&](SegmentWriter writer, const std::function<void(DicomWriter&)>& change = {}) {
    if (change) change(writer.file());
    return refusal({scratch.write("s.dcm", writer.file().file())});
  };
  const std::vector<SegmentFrame> frames = {{1, "0\\0\\0", "#....."}, {2, "0\\0\\0", "#....."}};
  EXPECT_THAT(refused({{{1, "a"}}, frames}), HasSubstr("frame 2 is of segment 2, which SegmentSequence has not"));
  EXPECT_THAT(refused({{{1, "a"}, {1, "b"}}, frames}), HasSubstr("SegmentNumber: 1 comes twice"));
  EXPECT_THAT(refused({kTwo, {{1, "", "#....."}, {2, "", "#....."}}}),
              HasSubstr("frames of several segments do not say where they lie"));
  EXPECT_THAT(refused({kTwo, frames}, [](DicomWriter& w) { w.text(0x00620001, "CS", "OTHER"); }),
              HasSubstr("SegmentationType: OTHER"));
  EXPECT_THAT(
      refused({kTwo, frames}, [](DicomWriter& w) { w.whole(0x00280100, 8).whole(0x00280102, 0).whole(0x00280101, 1); }),
      HasSubstr("BitsAllocated: 8 of a segmentation that is BINARY"));
  scratch.write("d/1.dcm", SegmentWriter(kTwo, frames).file().file());
  scratch.write("d/2.dcm", SegmentWriter(kTwo, frames).file().file());
  EXPECT_THAT(refusal({scratch.path("d")}), HasSubstr("holds 2 segmentations, 1.dcm and 2.dcm among them"));
  // Text of Latin 1, and of an unknown set.
  for (const auto& [characters, name] :
       {std::pair("ISO_IR 100", "L\xc3\xa9"), std::pair("ISO_IR 192", "L?"), std::pair("ISO 2022 IR 87", "L?")}) {
    SegmentWriter writer({{1, "L\xe9"}}, {{1, "0\\0\\0", "#....."}});
    writer.file().text(0x00080005, "CS", characters);
    const auto source = openSource({scratch.write("s.dcm", writer.file().file())}, {});
    EXPECT_EQ(source->info().channels[0].labels[0].name, name);
  }
}

TEST(ImportDicomSegments, SurviveCutsAndFlippedBits) {
  const Scratch scratch;
  SegmentWriter writer(kTwo, {{2, "1\\2\\14", "....##"}, {1, "1\\2\\10", "##...."}, {2, "1\\2\\10", "...#.."}});
  survivesBreakingInBounds(scratch, "x.dcm", writer.file().file());
}

}  // namespace
}  // namespace blockwalk
