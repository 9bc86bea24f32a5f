// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <utility>

#include "tests/cli/run_binary.h"

namespace blockwalk {
namespace {

using nlohmann::json;
using testing::HasSubstr;

// A ball of 20 x 16 x 12 voxels whose values are their squared distance from its surface.
template <typename T>
std::string ballVoxels(double inside, double outside) {
  std::string bytes;
  for (int z = 0; z < 12; ++z) {
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 20; ++x) {
        const int distance = (x - 10) * (x - 10) + (y - 8) * (y - 8) + (z - 6) * (z - 6);
        const T value = static_cast<T>(distance < 25 ? inside + distance : outside);
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
      }
    }
  }
  return bytes;
}

TEST(RoundTrip, VerifyReadsAllOfEachFile) {
  const Workplace place;
  ASSERT_EQ(place.run("demo fossil --size 48 -o good.bwv").exit_code, 0);
  std::filesystem::copy_file(place.path("good.bwv"), place.path("bad.bwv"));
  const Outcome good = place.run("verify good.bwv");
  EXPECT_EQ(good.exit_code, 0) << good.error;
  EXPECT_THAT(good.out, HasSubstr("are right, 0 faults"));
  std::string bytes = place.read("bad.bwv");
  bytes.back() = static_cast<char>(~bytes.back());
  place.write("bad.bwv", bytes);
  const Outcome bad = place.run("verify good.bwv bad.bwv none.bwv");
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_THAT(bad.out, HasSubstr("good.bwv: "));
  EXPECT_THAT(bad.out, HasSubstr("are right, 1 faults\n  bad.bwv: "));
  EXPECT_THAT(bad.out, HasSubstr("none.bwv: "));
  EXPECT_THAT(bad.error, HasSubstr("2 faults"));
}

TEST(RoundTrip, ChannelsKeepTheirNamesAndThresholds) {
  const Workplace place;
  const std::string first = ballVoxels<std::uint16_t>(100, 0);
  const std::string second = ballVoxels<std::uint16_t>(500, 40);
  place.write("planes.raw", first + second);
  const std::string raw = "import planes.raw -o c.bwv --dims 20x16x12 --type u16 --verify ";
  const Outcome made = place.run(raw + "--channels 2 --planar --channel-names DAPI,GFP --empty 110,40");
  ASSERT_EQ(made.exit_code, 0) << made.error;
  EXPECT_THAT(made.out, HasSubstr("verified           3840 voxels"));
  const json info = infoOf(place, "c.bwv");
  ASSERT_EQ(info["channels"].size(), 2u);
  EXPECT_EQ(info["channels"][0]["name"], "DAPI");
  EXPECT_EQ(info["channels"][0]["empty_threshold"], 110);
  EXPECT_EQ(info["channels"][0]["density_range"][0], 111);
  EXPECT_EQ(info["channels"][1]["name"], "GFP");
  EXPECT_EQ(info["channels"][1]["density_range"][0], 500);
  EXPECT_THAT(place.run("info c.bwv").out, HasSubstr("channel 1         GFP"));
  place.write("a.raw", first);
  place.write("b.raw", second);
  const std::string separate = "import a.raw b.raw --channels separate -o s.bwv --dims 20x16x12 --type u16 --verify";
  EXPECT_EQ(place.run(separate + " --channel-names DAPI,GFP --empty 110,40").exit_code, 0);
  EXPECT_EQ(infoOf(place, "s.bwv")["channels"], info["channels"]);
  EXPECT_EQ(place.run(raw + "--channels 5").exit_code, 2);
  EXPECT_EQ(place.run(raw + "--channels 2 --empty 1,2,3").exit_code, 1);
}

TEST(RoundTrip, PagesArePackedAsAskedAndSayHow) {
  const Workplace place;
  place.write("ball.raw", ballVoxels<std::uint16_t>(100, 0));
  const std::string import = "import ball.raw --dims 20x16x12 --type u16 --verify ";
  std::uint64_t raw_bytes = 0;
  for (const char* codec : {"raw", "lz4", "zstd"}) {
    const Outcome made = place.run(import + "-o p.bwv --codec " + codec);
    ASSERT_EQ(made.exit_code, 0) << made.error;
    EXPECT_THAT(made.out, HasSubstr(std::string("pages              1 ") + codec));
    EXPECT_THAT(made.out, HasSubstr("verified           3840 voxels"));
    EXPECT_THAT(place.run("info p.bwv").out, HasSubstr(std::string("pages             1 ") + codec));
    const json info = infoOf(place, "p.bwv");
    EXPECT_EQ(info["pages"], json({{codec, 1}}));
    if (raw_bytes == 0) raw_bytes = info["file_bytes"];
    EXPECT_EQ(info["file_bytes"] < raw_bytes, std::string(codec) != "raw");
  }
  EXPECT_EQ(place.run(import + "-o q.bwv").exit_code, 0);
  EXPECT_EQ(infoOf(place, "q.bwv")["pages"], json({{"raw", 1}}));
  EXPECT_EQ(place.run(import + "-o p.bwv --codec lzma").exit_code, 2);
}

TEST(RoundTrip, LabelsAreGuessedToldAndKept) {
  const Workplace place;
  std::string checks;
  for (int i = 0; i < 96 * 96 * 96; ++i) {
    checks += (i % 96 / 3 + i / 96 % 96 / 3 + i / 96 / 96 / 3) % 2 == 0 ? '\2' : '\12';
  }
  place.write("checks.raw", checks);
  const std::string import = "import checks.raw -o l.bwv --dims 96x96x96 --type u8 ";
  const Outcome guessed = place.run(import);
  ASSERT_EQ(guessed.exit_code, 0) << guessed.error;
  EXPECT_THAT(guessed.out, HasSubstr("values             labels (a guess; --values intensity says otherwise)"));
  EXPECT_EQ(infoOf(place, "l.bwv")["values"], "labels");
  EXPECT_THAT(place.run("info l.bwv").out, HasSubstr("values            labels"));
  const std::string render = "render l.bwv -o o.png --size 48x36 --mode first-hit --tf ";
  EXPECT_EQ(place.run(render + "2:ff0000:1,3:00ff00:1,10:0000ff:1").exit_code, 0);
  const Outcome linear = place.run(render + "2:ff0000:1,10:0000ff:1 --filter linear");
  EXPECT_EQ(linear.exit_code, 2);
  EXPECT_THAT(linear.error, HasSubstr("--filter: linear: channel 0 holds labels"));
  const Outcome said = place.run(import + "--values intensity");
  ASSERT_EQ(said.exit_code, 0) << said.error;
  EXPECT_EQ(said.out.find("labels"), std::string::npos);
  EXPECT_EQ(infoOf(place, "l.bwv")["values"], "intensity");
  EXPECT_EQ(place.run(import + "--values names").exit_code, 2);
}

TEST(RoundTrip, WhoStopsReadingTheOutputLeavesNoPartialFile) {
  const Workplace place;
  place.write("ball.raw", ballVoxels<std::uint16_t>(100, 0));
  // Both outputs go to a reader that is gone before a byte comes.
  const std::string blockwalk = "'" BLOCKWALK_BINARY_DIR "/blockwalk' ";
  place.run("--version; { sleep 0.2; " + blockwalk +
            "import ball.raw -o b.bwv --dims 20x16x12 --type u16; } 2>&1 | (exec 0<&-)");
  EXPECT_TRUE(std::filesystem::exists(place.path("b.bwv")));
  for (const auto& entry : std::filesystem::directory_iterator(place.path(""))) {
    EXPECT_EQ(entry.path().filename().string().find("partial"), std::string::npos) << entry.path();
  }
  const Outcome broken = place.run("import ball.raw -o b.bwv --dims 20x16x12 --type u16 >/dev/full");
  EXPECT_EQ(broken.exit_code, 1);
}

TEST(RoundTrip, DemosBecomeVolumesOfTheirType) {
  const Workplace place;
  const std::pair<const char*, const char*> demos[] = {{"fossil", "rgba8"}, {"rock", "rgba8"}, {"chip", "rgba8"},
                                                       {"vessels", "u8"},   {"cells", "u16"},  {"smoke", "f32"},
                                                       {"tissue", "u16"}};
  for (const auto& [name, type] : demos) {
    const std::string file = std::string(name) + ".bwv";
    const Outcome made = place.run("demo " + std::string(name) + " -o " + file + " --size 40");
    ASSERT_EQ(made.exit_code, 0) << made.error;
    const json info = infoOf(place, file);
    EXPECT_EQ(info["type"], type);
    EXPECT_EQ(info["name"], name);
    EXPECT_GT(info["nonempty_voxels"], 0);
    const Outcome table = place.run("info " + file);
    EXPECT_EQ(table.exit_code, 0) << table.error;
    EXPECT_THAT(table.out, HasSubstr(type));
  }
  EXPECT_EQ(place.run("demo smoke -o again.bwv --size 40").exit_code, 0);
  EXPECT_EQ(place.read("again.bwv"), place.read("smoke.bwv"));
}

TEST(RoundTrip, RawImportsAndVerifiesInEveryType) {
  const Workplace place;
  const std::tuple<const char*, std::string, const char*> cases[] = {
      {"u8", ballVoxels<std::uint8_t>(100, 0), "u8"},      {"i8", ballVoxels<std::int8_t>(-60, 0), "u8"},
      {"u16", ballVoxels<std::uint16_t>(40000, 0), "u16"}, {"i16", ballVoxels<std::int16_t>(-900, -1000), "u16"},
      {"u32", ballVoxels<std::uint32_t>(70000, 0), "f32"}, {"i32", ballVoxels<std::int32_t>(5, -3), "f32"},
      {"f32", ballVoxels<float>(0.25, 0), "f32"},          {"f64", ballVoxels<double>(1.5, 0), "f32"}};
  for (const auto& [type, voxels, stored] : cases) {
    place.write("in.raw", voxels);
    const Outcome outcome = place.run("import in.raw -o out.bwv --dims 20x16x12 --type " + std::string(type) +
                                      " --spacing 1,1,2.5 --verify");
    ASSERT_EQ(outcome.exit_code, 0) << type << outcome.error;
    EXPECT_THAT(outcome.out, HasSubstr("verified           3840 voxels")) << type;
    const json info = infoOf(place, "out.bwv");
    EXPECT_EQ(info["type"], stored) << type;
    EXPECT_EQ(info["spacing"], json({1, 1, 2.5}));
    EXPECT_EQ(info["dims"], json({20, 16, 12}));
  }
}

TEST(RoundTrip, PeopleSeeDataUnits) {
  const Workplace place;
  place.write("in.raw", ballVoxels<std::int16_t>(-900, -1000));
  ASSERT_EQ(place.run("import in.raw -o out.bwv --dims 20x16x12 --type i16").exit_code, 0);
  const json info = infoOf(place, "out.bwv");
  EXPECT_EQ(info["empty_threshold"], -1000);
  EXPECT_EQ(info["density_range"], json({-900, -876}));
  ASSERT_EQ(place.run("import in.raw -o cut.bwv --dims 20x16x12 --type i16 --empty -890").exit_code, 0);
  const json cut = infoOf(place, "cut.bwv");
  EXPECT_EQ(cut["empty_threshold"], -890);
  EXPECT_LT(cut["nonempty_voxels"], info["nonempty_voxels"]);
}

TEST(RoundTrip, BuildParametersAndDataFormsAreKept) {
  const Workplace place;
  const std::string voxels = ballVoxels<std::uint8_t>(100, 0);
  place.write("data.raw", voxels);
  place.write("head.nhdr",
              "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 20 16 12\nspacings: 2 2 2\nencoding: raw\n"
              "data file: data.raw\n");
  const Outcome outcome = place.run("import head.nhdr -o out.bwv --subblock 4 --block 3 --memory 96MiB --verify");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  const json info = infoOf(place, "out.bwv");
  EXPECT_EQ(info["subblock_side"], 4);
  EXPECT_EQ(info["block_side"], 3);
  EXPECT_EQ(info["spacing"], json({2, 2, 2}));
  EXPECT_EQ(info["source"], "head.nhdr");
  const std::string told = place.run("info out.bwv").out;
  EXPECT_THAT(told, HasSubstr("spacing           2 x 2 x 2 (spacings)\n"));
  EXPECT_THAT(told, HasSubstr("read_from         12 slices in 1 file\n"));
  EXPECT_THAT(outcome.error, HasSubstr("verify: ")) << "one line a step where there is no terminal";
}

TEST(RoundTrip, ADryRunTellsAndWritesNothing) {
  const Workplace place;
  place.write("data.raw", ballVoxels<std::uint8_t>(100, 0));
  place.write("head.nhdr",
              "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 20 16 12\nspace: left-posterior-superior\n"
              "space directions: (2,0,0) (0,2,0) (0,0,3)\nspace units: \"mm\" \"mm\" \"mm\"\nencoding: raw\n"
              "data file: data.raw\n");
  const Outcome outcome = place.run("import head.nhdr --dry-run -o out.bwv");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  for (const char* line :
       {"head.nhdr: 20 x 16 x 12 voxels of u8, 3.75 KiB dense", "spacing            2 x 2 x 3 mm (space directions)",
        "read from          12 slices in 1 file", "first corner       0 0 0",
        "space              left-posterior-superior", "format             nrrd"}) {
    EXPECT_THAT(outcome.out, HasSubstr(line));
  }
  EXPECT_FALSE(std::filesystem::exists(place.path("out.bwv")));
  EXPECT_EQ(place.run("import absent.nhdr --dry-run").exit_code, 1);
}

// 32-bit integers near two thousand millions.
TEST(RoundTrip, ValuesFarFromZeroKeepTheirDifferences) {
  const Workplace place;
  std::vector<std::int32_t> values(20 * 16 * 12);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = 2'000'000'001 + static_cast<std::int32_t>(i % 97);
  place.write("a.raw", std::string(reinterpret_cast<const char*>(values.data()), values.size() * 4));
  const Outcome outcome = place.run("import a.raw --dims 20x16x12 --type i32 -o out.bwv --verify");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  EXPECT_THAT(outcome.out, HasSubstr("samples are stored less 20000000"));
  const json info = infoOf(place, "out.bwv");
  EXPECT_EQ(info["density_range"], json({2'000'000'001, 2'000'000'097}));
  EXPECT_EQ(info["largest_rounding"], 0);
}

// Strips of 16 x 16 rows of four channels take more than half of what the limit leaves, and much less than 2 GiB.
TEST(RoundTrip, TakesHalfOfWhatIsFreeWhereNoMemoryIsTold) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer needs all addresses";
#endif
  const Workplace place;
  place.write("wide.raw", "");
  std::filesystem::resize_file(place.path("wide.raw"), std::uint64_t{20000} * 16 * 16 * 4 * sizeof(float));
  const std::string import =
      "import wide.raw -o out.bwv --dims 20000x16x16 --type f32 --channels 4 --subblock 16 --block 1";
  const Outcome outcome = place.run(import, "ulimit -v 700000;");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.out;
  EXPECT_THAT(outcome.error, HasSubstr("must be at least"));
  EXPECT_EQ(place.run(import + " --memory 2GiB").exit_code, 0);
}

TEST(RoundTrip, ReportsWhatConversionChanged) {
  const Workplace place;
  const double values[] = {0.1, std::numeric_limits<double>::quiet_NaN(), 3, std::numeric_limits<double>::infinity()};
  place.write("in.raw", std::string(reinterpret_cast<const char*>(values), sizeof values));
  const Outcome outcome = place.run("import in.raw -o out.bwv --dims 4x1x1 --type f64 --verify");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  EXPECT_THAT(outcome.out, HasSubstr("not finite         2 voxels"));
  EXPECT_THAT(outcome.out, HasSubstr("largest rounding   1.49"));
}

// With the flags that an export names, import makes the same voxels again.
TEST(RoundTrip, AnExportComesBackWithTheFlagsThatItNames) {
  const Workplace place;
  ASSERT_EQ(place.run("demo tissue -o v.bwv --size 50").exit_code, 0);
  const json volume = infoOf(place, "v.bwv");
  const std::pair<const char*, const char*> cases[] = {
      {"a.nrrd", ""}, {"a.raw", ""}, {"a", "--format nrrd --channels 2,0"}, {"a.prism", "--channels 1"}};
  for (const auto& [out, flags] : cases) {
    const Outcome made = place.run("export v.bwv -o " + std::string(out) + " " + flags);
    ASSERT_EQ(made.exit_code, 0) << made.error;
    const std::string label = "import again with  ";
    const std::size_t begin = made.out.find(label) + label.size();
    const std::string again = made.out.substr(begin, made.out.find('\n', begin) - begin);
    const Outcome back = place.run("import " + std::string(out) + " -o w.bwv --verify " + again);
    ASSERT_EQ(back.exit_code, 0) << back.error;
    const json info = infoOf(place, "w.bwv");
    EXPECT_EQ(info["dims"], volume["dims"]);
    EXPECT_EQ(info["type"], volume["type"]);
    const bool is_whole = std::string(flags).empty();
    EXPECT_EQ(info["levels"] == volume["levels"], is_whole) << out;
  }
  EXPECT_EQ(infoOf(place, "w.bwv")["nonempty_voxels"], volume["channels"][1]["nonempty_voxels"]);
  const Outcome cut = place.run("export v.bwv -o cut.raw --level 1 --box 3,2,1,13,12,11");
  ASSERT_EQ(cut.exit_code, 0) << cut.error;
  EXPECT_THAT(cut.out, HasSubstr("cut.raw: 10 x 10 x 10 voxels of 3 x u16"));
  EXPECT_EQ(place.read("cut.raw").size(), 6000u);
  EXPECT_EQ(place.run("export v.bwv -o cut.raw --level 1 --box 0,0,0,26,1,1").exit_code, 1) << "25 voxels wide";
  EXPECT_EQ(place.run("export v.bwv -o a.prism --channels 1").exit_code, 1) << "is there already";
}

TEST(RoundTrip, AFailedImportKeepsTheOldFile) {
  const Workplace place;
  place.write("in.raw", ballVoxels<std::uint8_t>(100, 0));
  ASSERT_EQ(place.run("import in.raw -o out.bwv --dims 20x16x12 --type u8").exit_code, 0);
  const std::string before = place.read("out.bwv");
  EXPECT_EQ(place.run("import in.raw -o out.bwv --dims 20x16x13 --type u8").exit_code, 1);
  EXPECT_EQ(place.read("out.bwv"), before);
}

TEST(RoundTrip, RendersEveryFormatWithStats) {
  const Workplace place;
  ASSERT_EQ(place.run("demo fossil -o fossil.bwv --size 48").exit_code, 0);
  const Outcome png = place.run("render fossil.bwv -o a.png --size 40x30 --stats s.json --repeat 3 --range 130:255");
  ASSERT_EQ(png.exit_code, 0) << png.error;
  EXPECT_EQ(place.read("a.png").substr(1, 3), "PNG");
  EXPECT_THAT(png.out, HasSubstr("median"));
  const json stats = json::parse(place.read("s.json"));
  EXPECT_EQ(stats["rays"], 1200);
  EXPECT_EQ(stats["loop_bound_hits"], 0);
  ASSERT_EQ(place.run("render fossil.bwv -o a.jpg --size 40x30 --quality 70").exit_code, 0);
  EXPECT_EQ(place.read("a.jpg").substr(0, 2), "\xff\xd8");
  ASSERT_EQ(place.run("render fossil.bwv -o a.webp --size 40x30 --quality 70").exit_code, 0);
  EXPECT_EQ(place.read("a.webp").substr(8, 4), "WEBP");
  ASSERT_EQ(place.run("render fossil.bwv -o a.raw --size 40x30 --eye -1,-2,-90 --finder grid --no-ray-query").exit_code,
            0);
  EXPECT_EQ(place.read("a.raw").size(), 4800u);
  ASSERT_EQ(
      place.run("render fossil.bwv -o a.raw --size 40x30 --output position --planes '0,0,1,-9;1,1,0,-4'").exit_code, 0);
  EXPECT_EQ(place.read("a.raw").size(), 14400u);
  ASSERT_EQ(place.run("render fossil.bwv -o a.png --size 40x30 --output depth").exit_code, 0);
  EXPECT_EQ(place.read("a.png").substr(24, 2), std::string("\x10\0", 2)) << "grey of 16 bits";
  EXPECT_EQ(place.run("render fossil.bwv -o a.png --output depth --mode mean").exit_code, 2);
  EXPECT_EQ(place.run("render fossil.bwv -o a.png --tf 0:000000:0,1:ffffff:1").exit_code, 2);
  EXPECT_EQ(place.run("render fossil.bwv -o a.png --level 9").exit_code, 2);
}

TEST(RoundTrip, AnEmptyPictureIsWrittenAndSaysWhy) {
  const Workplace place;
  ASSERT_EQ(place.run("demo fossil -o fossil.bwv --size 48").exit_code, 0);
  const Outcome empty = place.run("render fossil.bwv -o a.png --size 40x30 --range 300:400 --stats s.json");
  EXPECT_EQ(empty.exit_code, 0);
  EXPECT_EQ(place.read("a.png").substr(1, 3), "PNG");
  EXPECT_THAT(empty.error, HasSubstr("the picture is empty (range): The range meets no density of the volume"));
  EXPECT_THAT(empty.error, HasSubstr("Try --range auto"));
  EXPECT_EQ(json::parse(place.read("s.json"))["reasons"][0]["change"]["range"], "auto");
  const Outcome clear = place.run("render fossil.bwv -o a.png --size 40x30 --extinction 0");
  EXPECT_THAT(clear.error, HasSubstr("Try --extinction 0.2"));
  EXPECT_EQ(place.run("render fossil.bwv -o a.png --size 40x30").error, "");
}

TEST(RoundTrip, ZarrHasLevelsAndSteps) {
  const Workplace place;
  const auto writeArray = [&](const std::string& folder, int side, const std::string& voxels) {
    std::filesystem::create_directories(place.path(folder));
    place.write(folder + "/.zarray", R"({"zarr_format":2,"shape":[2,1,1,)" + std::to_string(side) +
                                         R"(],"chunks":[1,1,1,8],"dtype":"|u1","order":"C","filters":null,)" +
                                         R"("fill_value":0,"compressor":null})");
    place.write(folder + "/0.0.0.0", voxels);
    place.write(folder + "/1.0.0.0", std::string(voxels.rbegin(), voxels.rend()));
  };
  writeArray("i.zarr/0", 8, "abcdefgh");
  writeArray("i.zarr/1", 4, "acegxxxx");
  place.write("i.zarr/.zgroup", R"({"zarr_format":2})");
  place.write("i.zarr/.zattrs",
              R"({"multiscales":[{"axes":["t","z","y","x"],"datasets":[{"path":"0"},{"path":"1"}]}]})");
  const auto rawOf = [&](const std::string& flags) {
    const Outcome made = place.run("import i.zarr -o i.bwv --verify " + flags);
    EXPECT_EQ(made.exit_code, 0) << made.error;
    EXPECT_EQ(place.run("export i.bwv -o i.raw").exit_code, 0);
    return place.read("i.raw");
  };
  EXPECT_EQ(rawOf(""), "abcdefgh");
  EXPECT_EQ(rawOf("--level 1"), "aceg");
  EXPECT_EQ(rawOf("--time 1"), "hgfedcba");
  EXPECT_THAT(place.run("import i.zarr -o i.bwv").out,
              HasSubstr("of the 2 steps in time it is number 0; --time chooses"));
  const Outcome beyond = place.run("import i.zarr -o i.bwv --level 2");
  EXPECT_EQ(beyond.exit_code, 1);
  EXPECT_THAT(beyond.error, HasSubstr("level 2 is asked for, must be 0..1"));
  EXPECT_EQ(place.run("import i.zarr -o i.bwv --time -1").exit_code, 2);
}

}  // namespace
}  // namespace blockwalk
