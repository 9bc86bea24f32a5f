// SPDX-License-Identifier: Apache-2.0
// What the program asks of the driver before it draws: the vectors' width, and where kernels are kept.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/cli/run_binary.h"

namespace blockwalk {
namespace {

using nlohmann::json;

// The environment of the programs that are run, as it was afterwards.
class DriverTest : public testing::Test {
 protected:
  DriverTest() {
    for (const char* name : kNames) {
      const char* value = std::getenv(name);
      before_.emplace_back(value != nullptr, value != nullptr ? value : "");
      unsetenv(name);
    }
    setenv("XDG_CACHE_HOME", place.path("cache").c_str(), 1);
  }
  ~DriverTest() override {
    for (std::size_t i = 0; i < std::size(kNames); ++i) {
      if (before_[i].first) {
        setenv(kNames[i], before_[i].second.c_str(), 1);
      } else {
        unsetenv(kNames[i]);
      }
    }
  }

  json device() const {
    const Outcome outcome = place.run("info --device --json");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
    return json::parse(outcome.out);
  }
  bool isLavapipe() const { return device()["driver"] == "llvmpipe"; }
  bool hasWideVectors() const {
    return device()["set_up"].get<std::string>().find("times as fast") != std::string::npos;
  }
  // Bytes of what is kept below a folder of the cache.
  std::uintmax_t kept(const std::string& folder) const {
    std::uintmax_t bytes = 0;
    std::error_code absent;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(place.path("cache/" + folder), absent)) {
      if (entry.is_regular_file()) bytes += entry.file_size();
    }
    return bytes;
  }

  const Workplace place;

 private:
  static constexpr const char* kNames[] = {"LP_NATIVE_VECTOR_WIDTH", "MESA_SHADER_CACHE_DIR",
                                           "MESA_SHADER_CACHE_DISABLE", "MESA_SHADER_CACHE_MAX_SIZE", "XDG_CACHE_HOME"};
  std::vector<std::pair<bool, std::string>> before_;
};

TEST_F(DriverTest, TheEnvironmentsWidthIsTaken) {
  if (!isLavapipe()) GTEST_SKIP() << "another driver draws";
  for (const int bits : {128, 256}) {
    setenv("LP_NATIVE_VECTOR_WIDTH", std::to_string(bits).c_str(), 1);
    EXPECT_EQ(device()["subgroup_size"], bits / 32);
  }
}

TEST_F(DriverTest, WhatWasMeasuredIsRemembered) {
  if (!isLavapipe() || !hasWideVectors()) GTEST_SKIP() << "no lavapipe, or no AVX-512";
  const std::string measured = place.read("cache/blockwalk/vector_width");
  const std::size_t tab = measured.find('\t');
  ASSERT_NE(tab, std::string::npos) << measured;
  place.write("cache/blockwalk/vector_width", measured.substr(0, tab) + "\t2.0\n");
  EXPECT_EQ(device()["subgroup_size"], 16);
  place.write("cache/blockwalk/vector_width", measured.substr(0, tab) + "\t0.5\n");
  EXPECT_EQ(device()["subgroup_size"], 8);
  // Of another processor, or spoilt: measured anew.
  for (const char* other : {"Another processor 1\t0.5\n", "\t\t\n", ""}) {
    place.write("cache/blockwalk/vector_width", other);
    device();
    EXPECT_EQ(place.read("cache/blockwalk/vector_width").substr(0, tab), measured.substr(0, tab));
  }
}

TEST_F(DriverTest, KernelsOfOneWidthAreNotTakenForAnothers) {
  if (!isLavapipe()) GTEST_SKIP() << "another driver draws";
  ASSERT_EQ(place.run("demo fossil -o fossil.bwv --size 32").exit_code, 0);
  std::vector<std::string> pictures;
  for (const std::string bits : {"128", "256"}) {
    setenv("LP_NATIVE_VECTOR_WIDTH", bits.c_str(), 1);
    EXPECT_EQ(kept("blockwalk/kernels/vectors-" + bits), 0u);
    const Outcome drawn = place.run("render fossil.bwv -o " + bits + ".raw --size 48x32");
    ASSERT_EQ(drawn.exit_code, 0) << drawn.error;
    EXPECT_GT(kept("blockwalk/kernels/vectors-" + bits), 1000u);
    pictures.push_back(place.read(bits + ".raw"));
  }
  EXPECT_EQ(pictures[0], pictures[1]);
  // A folder of the user's own is as separate.
  setenv("MESA_SHADER_CACHE_DIR", place.path("cache/own").c_str(), 1);
  ASSERT_EQ(place.run("render fossil.bwv -o own.raw --size 48x32").exit_code, 0);
  EXPECT_GT(kept("own/vectors-256"), 1000u);
  EXPECT_EQ(place.read("own.raw"), pictures[0]);
}

TEST_F(DriverTest, WithoutAFolderNothingIsKept) {
  place.write("cache", "a file where the folder should be");
  EXPECT_THAT(device()["set_up"], testing::HasSubstr("no folder"));
  ASSERT_EQ(place.run("demo fossil -o fossil.bwv --size 32").exit_code, 0);
  EXPECT_EQ(place.run("render fossil.bwv -o a.raw --size 8x8").exit_code, 0);
}

TEST_F(DriverTest, AFinderThatIsSlowWithoutHardwareIsTold) {
  const json device = this->device();
  if (device["kind"] != "software" || device["ray_query"] != true) GTEST_SKIP() << "hardware here, or no ray queries";
  ASSERT_EQ(place.run("demo smoke -o a.bwv --size 24").exit_code, 0);
  for (const char* finder : {"boundary", "clusters", "grid", "auto"}) {
    const Outcome outcome = place.run(fmt::format("render a.bwv -o a.png --size 16x16 --finder {}", finder));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
    const bool is_told = outcome.error.find(fmt::format("blockwalk: finder {}: slow on ", finder)) != std::string::npos;
    EXPECT_EQ(is_told, finder == std::string("boundary") || finder == std::string("clusters")) << outcome.error;
  }
}

}  // namespace
}  // namespace blockwalk
