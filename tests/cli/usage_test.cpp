// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cli/run_binary.h"

namespace blockwalk {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::StartsWith;

std::string lastLine(std::string text) {
  if (text.ends_with('\n')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

struct BadUse {
  const char* arguments;
  int exit_code;
  const char* message;  // part of what stderr says
};

const BadUse kBadUses[] = {
    {"", 2, "animate, demo, doctor, import, export, info, render, slice or verify"},
    {"animate absent.bwv -o a.webp", 1, "absent.bwv"},
    {"animate absent.bwv -o a.webp --fps 0", 2, "--fps: must be from 0.1 to 120"},
    {"animate absent.bwv -o a.webp --keys k.json --degrees 90", 2, "--degrees: --keys says it"},
    {"animate absent.bwv -o a.webp --keys absent.json", 1, "absent.json"},
    {"doctor --port 0", 2, "--port"},
    {"slice", 2, "FILE|URL"},
    {"slice absent.bwv -o a.png --axis z --index 1", 1, "absent.bwv"},
    {"slice absent.bwv -o a.tiff --axis z --index 1", 2, ".png .webp .npy .raw .nrrd"},
    {"slice absent.bwv -o a.png", 2, "--axis: is missing"},
    {"slice absent.bwv -o a.png --axis z --index 1 --gamma 0", 2, "--gamma: must be from 0.01 to 100"},
    {"teapot", 2, "teapot"},
    {"bench masks", 2, "bench"},
    {"--nonsense", 2, "nonsense"},
    {"demo", 2, "NAME"},
    {"demo fossil", 2, "-o"},
    {"demo teapot -o a.bwv", 2, "teapot"},
    {"demo fossil -o a.bwv --size 0", 2, "--size"},
    {"demo fossil -o a.bwv --size 65537", 2, "--size"},
    {"demo fossil -o a.bwv --size many", 2, "--size"},
    {"demo cosmos -o a.bwv --size 65537", 2, "--size"},
    {"demo cosmos -o a.bwv --type u8", 2, "--type"},
    {"demo fossil -o a.bwv --size 8 --type f32", 1, "there is rgba8"},
    {"demo fossil -o a.bwv --subblock 5", 2, "--subblock"},
    {"demo fossil -o a.bwv --block 7", 2, "--block"},
    {"demo fossil -o a.bwv --memory 2GB", 2, "--memory"},
    {"demo fossil -o a.bwv --memory 95MiB", 2, "--memory"},
    {"demo fossil -o a.bwv --memory 99999999999999TiB", 2, "--memory"},
    {"demo fossil -o a.bwv --bins some", 2, "--bins"},
    {"demo fossil -o a.bwv --empty nan", 2, "--empty"},
    {"demo fossil -o absent/a.bwv --size 8", 1, "absent"},
    {"import", 2, "SOURCE"},
    {"import a.raw", 2, "-o"},
    {"import absent.raw -o a.bwv", 1, "absent.raw"},
    {"import data.raw -o a.bwv", 1, "--dims and --type"},
    {"import data.raw -o a.bwv --dims 4x4 --type u8", 2, "--dims"},
    {"import data.raw -o a.bwv --dims 4x4x0 --type u8", 2, "--dims"},
    {"import data.raw -o a.bwv --dims 4x4x4x4 --type u8", 2, "--dims"},
    {"import data.raw -o a.bwv --dims 4x4x65537 --type u8", 2, "--dims"},
    {"import data.raw -o a.bwv --dims 4x4x5 --type u8", 1, "80"},
    {"import data.raw -o a.bwv --dims 4x4x4 --type u9", 2, "--type"},
    {"import data.raw -o a.bwv --dims 4x4x4 --type u8 --spacing 1,2", 2, "--spacing"},
    {"import data.raw -o a.bwv --dims 4x4x4 --type u8 --spacing 1,0,1", 2, "--spacing"},
    {"import data.raw -o a.bwv --dims 4x4x4 --type u8 --spacing 1,inf,1", 2, "--spacing"},
    {"import data.raw -o a.bwv --dims 4x4x4 --type u8 --density some", 2, "--density"},
    {"import data.raw -o a.bwv --dims 4x4x4 --type u8 --density max", 1, "density"},
    {"import data.raw -o a.bwv --dims 4x4x4 --type u8 --skip -1", 2, "--skip"},
    {"import data.raw -o data.raw --dims 4x4x4 --type u8", 2, "data.raw"},
    {"import . -o a.bwv", 1, "holds no slices"},
    {"export", 2, "FILE"},
    {"export data.raw", 2, "-o"},
    {"export data.raw -o a.nrrd", 1, "data.raw"},
    {"export data.raw -o a.bwv", 2,
     "-o: 'a.bwv' ends on none of .nrrd .nii .nii.gz .tif .tiff .zarr .nvdb .npy .raw .prism"},
    {"export data.raw -o a --format bmp", 2, "--format"},
    {"export data.raw -o data.raw", 2, "-o: data.raw is the volume to export"},
    {"export data.raw -o a.raw --level 18", 2, "--level"},
    {"export data.raw -o a.raw --box 0,0,0,1,1", 2, "--box: '0,0,0,1,1' must be x0,y0,z0,x1,y1,z1"},
    {"export data.raw -o a.raw --box 0,0,0,1,0,1", 2, "--box"},
    {"export data.raw -o a.raw --box 0,0,0,1,1,65537", 2, "--box"},
    {"export data.raw -o a.raw --box=-1,0,0,1,1,1", 2, "--box"},
    {"export data.raw -o a.raw --channels 0,0", 2, "--channels"},
    {"info", 2, "FILE|URL"},
    {"info absent.bwv", 1, "absent.bwv"},
    {"info data.raw", 1, "data.raw"},
    {"info ftp://127.0.0.1/fossil", 2, "only http"},
    {"info ./http://127.0.0.1/fossil", 1, "./http://127.0.0.1/fossil"},
    {"info 'http://[::1/fossil'", 2, "bracket"},
    {"info 'http://[localhost]/fossil'", 2, "IPv6"},
    {"info http://::1/fossil", 2, "names no host"},
    {"info http://a@b/fossil", 2, "names no host"},
    {"info http://127.0.0.1:0/fossil", 2, "port"},
    {"info http://127.0.0.1:65536/fossil", 2, "port"},
    {"info http://127.0.0.1:8080x/fossil", 2, "port"},
    {"info http://127.0.0.1:1/fossil --ca absent.pem", 2, "absent.pem"},
    {"info https://127.0.0.1:1/fossil --ca data.raw --insecure", 2, "--insecure"},
    {"info https://127.0.0.1:1/fossil --ca data.raw", 2, "--ca: 'data.raw' holds no certificate in PEM"},
    {"info http://127.0.0.1:1/fossil --ca data.raw", 2, "--ca"},
    {"render data.raw -o a.png --nonsense 1", 2, "see blockwalk render --help"},
    {"info http://127.0.0.1:1/fossil --token ''", 1, "no answer"},
    {"info http://127.0.0.1:1/fossil --token 'a b'", 2, "--token"},
    {"info data.raw --token secret", 2, "--token"},
    {"render data.raw -o a.png --insecure", 2, "--insecure"},
    {"info http://127.0.0.1", 2, "names no volume"},
    {"info http://127.0.0.1/a/b/c", 2, "http://HOST:PORT/ID"},
    {"info http://:80/a", 2, "names no host"},
    {"info http://127.0.0.1:1/fossil", 1, "no answer"},
    {"render", 2, "FILE|URL"},
    {"render data.raw", 2, "-o"},
    {"render data.raw -o a.png", 1, "data.raw"},
    {"render data.raw -o a.tga", 2, "a.tga"},
    {"render data.raw -o a.png --size 0x5", 2, "--size"},
    {"render data.raw -o a.png --size 8193x5", 2, "--size"},
    {"render data.raw -o a.png --size 5x5 --size 6x6", 2, "--size"},
    {"render data.raw -o a.png --eye 1,2", 2, "--eye"},
    {"render data.raw -o a.png --eye 1,2,nan", 2, "--eye"},
    {"render data.raw -o a.png --fov 180", 2, "--fov"},
    {"render data.raw -o a.png --fov 20 --ortho 3", 2, "fov"},
    {"render data.raw -o a.png --range 10", 2, "--range"},
    {"render data.raw -o a.png --mode sideways", 2, "--mode"},
    {"render data.raw -o a.png --finder luck", 2, "--finder"},
    {"render data.raw -o a.png --walk maybe", 2, "--walk"},
    {"render data.raw -o a.png --background 12345", 2, "--background"},
    {"render data.raw -o a.png --quality 101", 2, "--quality"},
    {"render data.raw -o a.png --repeat 0", 2, "--repeat"},
    {"render data.raw -o a.png --chunk-mib 0", 2, "--chunk-mib"},
    {"render http://127.0.0.1:1/a -o a.png --device 0", 2, "--device"},
    {"render http://127.0.0.1:1/a -o a.png", 1, "no answer"},
};

TEST(Usage, NamesWhatIsWrongAndLeavesNoFile) {
  const Workplace place;
  place.write("data.raw", std::string(64, 'x'));
  for (const BadUse& use : kBadUses) {
    const Outcome outcome = place.run(use.arguments);
    EXPECT_EQ(outcome.exit_code, use.exit_code) << use.arguments << "\n" << outcome.error;
    EXPECT_THAT(outcome.error, HasSubstr(use.message)) << use.arguments;
    // One form for all, whoever finds it; warnings and steps may stand before.
    EXPECT_THAT(lastLine(outcome.error), StartsWith("blockwalk: ")) << use.arguments;
    EXPECT_EQ(place.read("data.raw"), std::string(64, 'x')) << use.arguments;
    EXPECT_FALSE(std::filesystem::exists(place.path("a.bwv"))) << use.arguments;
    EXPECT_FALSE(std::filesystem::exists(place.path("a.png"))) << use.arguments;
  }
}

TEST(Usage, WhatCannotBePrintedIsNotDone) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const Workplace place;
  ASSERT_EQ(place.run("demo smoke -o smoke.bwv --size 24").exit_code, 0);
  for (const char* arguments : {"info smoke.bwv", "info --json smoke.bwv", "--help"}) {
    const Outcome outcome = place.run(std::string(arguments) + " >/dev/full");
    EXPECT_EQ(outcome.exit_code, 1) << arguments;
    EXPECT_THAT(outcome.error, ContainsRegex("writ(e|ten)")) << arguments;
  }
}

TEST(Usage, HelpIsNoError) {
  const Workplace place;
  for (const char* arguments : {"--help", "demo --help", "import --help", "info --help", "render --help"}) {
    const Outcome outcome = place.run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << arguments;
    EXPECT_THAT(outcome.out, HasSubstr("--help")) << arguments;
  }
  EXPECT_EQ(place.run("--version").exit_code, 0);
}

}  // namespace
}  // namespace blockwalk
