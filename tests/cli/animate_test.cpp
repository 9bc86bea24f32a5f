// SPDX-License-Identifier: Apache-2.0
// `animate`: its frames are what `render` draws of their views; `slice`: what it writes is whole.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cli/run_binary.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

TEST(Animate, DrawsWhatRenderDraws) {
  const Workplace place;
  ASSERT_EQ(place.run("demo smoke -o smoke.bwv --size 24").exit_code, 0);
  const Outcome turn = place.run("animate smoke.bwv -o turn --seconds 0.3 --fps 10 --size 40x30 --mode mip");
  ASSERT_EQ(turn.exit_code, 0) << turn.error;
  EXPECT_THAT(turn.out, HasSubstr("turn: 3 frames, 10 a second"));
  ASSERT_EQ(place.run("render smoke.bwv -o one.png --size 40x30 --mode mip").exit_code, 0);
  EXPECT_EQ(place.read("turn/frame0000.png"), place.read("one.png"));
  EXPECT_NE(place.read("turn/frame0001.png"), place.read("one.png"));
  EXPECT_TRUE(std::filesystem::exists(place.path("turn/frame0002.png")));
  EXPECT_FALSE(std::filesystem::exists(place.path("turn/frame0003.png")));
  const Outcome again = place.run("animate smoke.bwv -o turn --seconds 0.3 --fps 10");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.error, HasSubstr("-o: turn is there and not empty"));
}

TEST(Animate, GoesFromKeyToKey) {
  const Workplace place;
  ASSERT_EQ(place.run("demo smoke -o smoke.bwv --size 24").exit_code, 0);
  place.write("keys.json", R"({"fps": 4, "keys": [{"seconds": 0, "view": {"size": [32, 24], "eye": [12, 12, 90]}},
                              {"seconds": 0.5, "view": {"size": [32, 24], "eye": [90, 12, 12]}}]})");
  const Outcome film = place.run("animate smoke.bwv -o film.webp --keys keys.json --quality 100");
  ASSERT_EQ(film.exit_code, 0) << film.error;
  EXPECT_THAT(film.out, HasSubstr("film.webp: 3 frames, 4 a second"));
  EXPECT_EQ(place.read("film.webp").substr(0, 4), "RIFF");
  EXPECT_THAT(place.read("film.webp"), HasSubstr("ANMF"));
  ASSERT_EQ(place.run("animate smoke.bwv -o frames --keys keys.json").exit_code, 0);
  ASSERT_EQ(place.run("render smoke.bwv -o last.png --size 32x24 --eye 90,12,12").exit_code, 0);
  EXPECT_EQ(place.read("frames/frame0002.png"), place.read("last.png"));
  place.write("keys.json", R"({"keys": [{"seconds": 0, "view": {"eye": [1, 2]}}]})");
  EXPECT_THAT(place.run("animate smoke.bwv -o a.webp --keys keys.json").error, HasSubstr("--eye: "));
}

TEST(Animate, TellsAFilmFromAFolderAndNumbers) {
  const Workplace place;
  ASSERT_EQ(place.run("demo smoke -o smoke.bwv --size 24").exit_code, 0);
  for (const char* output : {"depth", "value", "position --mode first-hit", "cost", "queries"}) {
    for (const char* name : {"turn.webp", "turn"}) {
      const Outcome numbers = place.run(fmt::format("animate smoke.bwv -o {} --seconds 0.1 --output {}", name, output));
      EXPECT_EQ(numbers.exit_code, 2) << output << numbers.error;
      EXPECT_THAT(numbers.error, HasSubstr("--output: an animation is of pictures"));
      EXPECT_FALSE(std::filesystem::exists(place.path(name)));
    }
  }
  const Outcome film = place.run("animate smoke.bwv -o turn.WEBP --seconds 0.2 --fps 10 --size 32x24");
  ASSERT_EQ(film.exit_code, 0) << film.error;
  EXPECT_EQ(place.read("turn.WEBP").substr(0, 4), "RIFF");
}

TEST(SliceCommand, WritesPicturesAndValues) {
  const Workplace place;
  ASSERT_EQ(place.run("demo smoke -o smoke.bwv --size 24").exit_code, 0);
  const Outcome values = place.run("slice smoke.bwv -o s.npy --axis z --index 7 --json");
  ASSERT_EQ(values.exit_code, 0) << values.error;
  EXPECT_EQ(nlohmann::json::parse(values.out)["level"], 0);
  const nlohmann::json dims = infoOf(place, "smoke.bwv")["dims"];
  const std::string box = fmt::format("0,0,7,{},{},8", dims[0].get<int>(), dims[1].get<int>());
  ASSERT_EQ(place.run("export smoke.bwv -o e.raw --box " + box).exit_code, 0);
  const std::string bytes = place.read("e.raw");
  EXPECT_EQ(place.read("s.npy").substr(place.read("s.npy").size() - bytes.size()), bytes);
  ASSERT_EQ(place.run("slice smoke.bwv -o s.png --axis z --index 7").exit_code, 0);
  EXPECT_EQ(place.read("s.png").substr(1, 3), "PNG");
  EXPECT_EQ(place.run("slice smoke.bwv -o smoke.bwv --format raw --axis z --index 7").exit_code, 2);
  EXPECT_THAT(place.run("slice smoke.bwv -o s.png --axis z --index 24").error, HasSubstr("--index: 24 is not within"));
}

}  // namespace
}  // namespace blockwalk
