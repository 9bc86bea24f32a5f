// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/cli/run_binary.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

// Steps of one file, or a file a step, in one volume; each comes out again.
TEST(Steps, GoInAndComeOut) {
  const Workplace place;
  const std::string header = "NRRD0004\ntype: uchar\ndimension: ";
  place.write("film.nrrd", header + "4\nsizes: 2 2 1 3\nkinds: space space space time\nencoding: raw\n\nabcdefghijkl");
  const Outcome dry = place.run("import film.nrrd --time all --dry-run");
  EXPECT_THAT(dry.out, HasSubstr("3 steps of 2 x 2 x 1 voxels of u8")) << dry.error;
  const Outcome made = place.run("import film.nrrd -o film.bwv --time all --verify");
  ASSERT_EQ(made.exit_code, 0) << made.error;
  EXPECT_THAT(made.out, HasSubstr("film.bwv: 3 steps of 2 x 2 x 1 voxels of u8"));
  EXPECT_THAT(made.out, HasSubstr("verified           12 voxels"));
  EXPECT_EQ(infoOf(place, "film.bwv")["steps"], 3);
  EXPECT_THAT(place.run("info film.bwv").out, HasSubstr("3, in time"));
  EXPECT_THAT(place.run("verify film.bwv").out, HasSubstr("0 faults"));
  std::string sources;
  for (int step = 0; step < 3; ++step) {
    const std::string name = "step" + std::to_string(step) + ".nrrd";
    ASSERT_EQ(place.run("export film.bwv -o out.raw --time " + std::to_string(step)).exit_code, 0);
    EXPECT_EQ(place.read("out.raw"), std::string("abcdefghijkl").substr(static_cast<std::size_t>(4 * step), 4));
    place.write(name, header + "3\nsizes: 2 2 1\nencoding: raw\n\n" + place.read("out.raw"));
    sources += name + " ";
  }
  const Outcome each = place.run("import " + sources + "-o each.bwv --time all");
  ASSERT_EQ(each.exit_code, 0) << each.error;
  EXPECT_EQ(infoOf(place, "each.bwv")["channels"], infoOf(place, "film.bwv")["channels"]);
  const Outcome part = place.run("import film.nrrd -o part.bwv --time 1:2");
  ASSERT_EQ(part.exit_code, 0) << part.error;
  ASSERT_EQ(place.run("export part.bwv -o out.raw --time 0").exit_code, 0);
  EXPECT_EQ(place.read("out.raw"), "efgh");
  EXPECT_EQ(place.run("export part.bwv -o out.raw --time 2").exit_code, 2);
  for (const char* wrong :
       {"--time 1:3", "--time 2:1", "--time -1", "--time x", "--time 1:", "--time 1:1", "--time all --frame 1"}) {
    const Outcome refused = place.run(std::string("import film.nrrd -o wrong.bwv ") + wrong);
    EXPECT_EQ(refused.exit_code, 2) << wrong << refused.out;
    EXPECT_THAT(refused.error, HasSubstr("--")) << wrong;
  }
  place.write("wide.nrrd", header + "3\nsizes: 2 1 1\nencoding: raw\n\nab");
  const Outcome apart = place.run("import step0.nrrd wide.nrrd -o wrong.bwv --time all");
  EXPECT_EQ(apart.exit_code, 1);
  EXPECT_THAT(apart.error, HasSubstr("wide.nrrd: step 1 has 1 channels of 2 x 1 x 1 u8"));
}

}  // namespace
}  // namespace blockwalk
