// SPDX-License-Identifier: Apache-2.0
// The house that the README draws, held to the #includes: an arrow only points down.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/house/arrows.h"

namespace blockwalk::house {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Bottom first.
House blockwalk() {
  const std::vector<std::string> no_vulkan{"vulkan/"};
  const std::vector<std::string> no_network{"boost/asio", "boost/beast", "openssl/"};
  const std::vector<std::string> neither{"vulkan/", "boost/asio", "boost/beast", "openssl/"};
  return {
      .rooms =
          {{"volume", {}, neither},
           {"volume/file", {"volume"}, neither},
           {"volume/build", {"volume", "volume/file"}, neither},
           {"volume/demo", {"volume"}, neither},
           {"volume/formats", {"volume"}, neither},
           {"volume/import", {"volume", "volume/formats"}, neither},
           {"volume/export", {"volume", "volume/formats", "volume/file", "volume/build"}, neither},
           {"volume/slice", {"volume", "volume/file", "volume/export"}, neither},
           {"view", {"volume"}, neither},
           {"protocol", {"view", "volume", "volume/file", "volume/export", "volume/slice"}, neither},
           {"shaders", {}, neither},
           {"renderer/plan", {"view", "volume", "shaders"}, neither},
           {"renderer/vulkan", {"renderer/plan", "view", "volume", "shaders"}, no_network},
           {"renderer/resident",
            {"renderer/plan", "renderer/vulkan", "view", "volume", "volume/file", "shaders"},
            no_network},
           {"renderer/find",
            {"renderer/plan", "renderer/vulkan", "renderer/resident", "view", "volume", "shaders"},
            no_network},
           {"renderer",
            {"renderer/plan", "renderer/vulkan", "renderer/resident", "renderer/find", "view", "volume", "volume/file",
             "shaders"},
            no_network},
           {"server/base", {"protocol", "view", "volume"}, no_vulkan},
           {"server/http", {"server/base", "protocol", "view", "volume"}, no_vulkan},
           {"server/render", {"server/base", "protocol", "renderer", "view", "volume", "volume/file"}, no_vulkan},
           {"server/region",
            {"server/render", "server/base", "protocol", "view", "volume", "volume/file", "volume/export",
             "volume/slice"},
            no_vulkan},
           {"server/state",
            {"server/region", "server/render", "server/http", "server/base", "protocol", "renderer", "view", "volume"},
            no_vulkan},
           {"server/stream",
            {"server/state", "server/render", "server/http", "server/base", "protocol", "view", "volume"},
            no_vulkan},
           {"server",
            {"server/stream", "server/state", "server/region", "server/render", "server/http", "server/base",
             "protocol", "renderer", "view", "volume", "volume/file"},
            no_vulkan},
           {"clients/cli", {"protocol", "renderer", "view", "volume/*"}, no_vulkan},
           {"bench/experiments",
            {"renderer/*", "protocol", "view", "volume/*", "shaders", "tests/reference"},
            no_network},
           {"bench", {"bench/experiments", "renderer", "protocol", "view", "volume"}, neither},
           {"tests/house", {}, neither},
           {"tests/volume", {"volume/*"}, neither},
           {"tests/view", {"view", "volume/*"}, neither},
           {"tests/protocol", {"protocol", "view", "volume/*"}, neither},
           {"tests/reference", {"view", "volume/*"}, neither},
           {"tests/renderer", {"tests/reference", "renderer/*", "protocol", "view", "volume/*", "shaders"}, no_network},
           {"tests/extreme", {"tests/renderer", "tests/reference", "renderer", "view", "volume/*"}, no_network},
           {"tests/server", {"server/*", "renderer", "protocol", "view", "volume/*", "tests/volume"}, no_vulkan},
           {"tests/cli", {"clients/cli", "protocol", "view", "volume/*"}, no_vulkan},
           {"tests/fuzz", {"tests/volume", "server/http", "server/base", "protocol", "view", "volume/*"}, no_vulkan}},
      .exceptions = {}};
}

TEST(House, ArrowsOnlyPointDown) {
  const House house = blockwalk();
  const std::vector<Include> includes = readIncludes(BLOCKWALK_SOURCE_DIR, house);
  EXPECT_GT(includes.size(), 1000u);
  EXPECT_THAT(faults(house, includes), IsEmpty());
  std::printf("%s%s", drawArrows(house, includes, "renderer").c_str(), drawArrows(house, includes, "server").c_str());
}

// A house of its own in a folder of its own.
class MadeHouse : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "blockwalk-house-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    root_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  void write(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }
  std::vector<std::string> faultsOf(const House& house) const { return faults(house, readIncludes(root_, house)); }

  std::filesystem::path root_{};
  House house_{.rooms = {{"low", {}, {"vulkan/"}}, {"high/inside", {"low"}}, {"high", {"high/*", "low"}}}};
};

TEST_F(MadeHouse, WhatPointsDownIsRight) {
  write("low/a.h", "#pragma once\n#include <vector>\n");
  write("high/inside/b.cpp", "#include \"low/a.h\"\n#include \"beside.h\"\n");
  write("high/c.cpp", "# include \"high/inside/b.h\"\n#include \"low/a.h\"\n");
  EXPECT_THAT(faultsOf(house_), IsEmpty());
  EXPECT_EQ(drawArrows(house_, readIncludes(root_, house_), "high"), "high > high/inside, low\nhigh/inside > low\n");
}

TEST_F(MadeHouse, WhatPointsUpIsAFault) {
  write("low/a.h", "#pragma once\n  #  include \"high/c.h\"  // why not\n");
  write("high/inside/b.glsl", "#include \"high/c.h\"\n");
  EXPECT_THAT(faultsOf(house_), ElementsAre("high/inside/b.glsl:1: high/inside may not stand on high (high/c.h)",
                                            "low/a.h:2: low may not stand on high (high/c.h)"));
}

TEST_F(MadeHouse, WhatIsOutsideIsAFault) {
  write("low/a.h", "#include <vulkan/vulkan.hpp>\n#include \"cellar/a.h\"\n");
  EXPECT_THAT(faultsOf(house_),
              ElementsAre("low/a.h:1: low does without vulkan/vulkan.hpp", "low/a.h:2: cellar/a.h is in no room"));
  House other = house_;
  other.rooms.erase(other.rooms.end() - 1);
  write("low/a.h", "");
  write("high/c.cpp", "#include \"low/a.h\"\n");
  EXPECT_THAT(faultsOf(other), ElementsAre("high/c.cpp:1: is in no room"));
}

TEST_F(MadeHouse, AnExceptionHoldsWhileItIsNeeded) {
  house_.exceptions = {{"low", "high", "for now"}};
  write("low/a.h", "#include \"high/c.h\"\n");
  EXPECT_THAT(faultsOf(house_), IsEmpty());
  write("low/a.h", "");
  EXPECT_THAT(faultsOf(house_), ElementsAre("no exception needed: low > high is not there"));
}

TEST_F(MadeHouse, ACircleOfRoomsIsAFault) {
  house_.rooms[0].stands_on = {"high/inside"};
  EXPECT_THAT(faultsOf(house_), ElementsAre("high/inside may stand on itself, over other rooms",
                                            "low may stand on itself, over other rooms"));
}

}  // namespace
}  // namespace blockwalk::house
