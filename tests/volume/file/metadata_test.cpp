// SPDX-License-Identifier: Apache-2.0
#include "volume/file/metadata.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "volume/error.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

VolumeInfo everythingKnown() {
  VolumeInfo info;
  info.metadata = {.source_name = "scan.nrrd",
                   .source_kind = "nrrd",
                   .length_unit = "mm",
                   .space = "left-posterior-superior",
                   .others = {{"scanner", "a new key"}, {"channel.0.gain", "7"}}};
  info.channels.resize(2);
  info.channels[0].name = "blå";
  info.channels[0].unit = "HU";
  info.channels[0].color = Color{255, 0, 16};
  info.channels[0].window = {-100.5, 1e30};
  info.channels[1].labels = {
      {.value = -2, .name = "air"}, {.value = 3, .name = "left lung", .color = Color{1, 2, 3}}, {.value = 70000}};
  return info;
}

TEST(Metadata, ComesBackAsItWas) {
  const VolumeInfo info = everythingKnown();
  const std::string text = encodeMetadata(info, "a.bwv");
  VolumeInfo back;
  back.channels.resize(2);
  decodeMetadata(text, 0, "a.bwv", back);
  EXPECT_EQ(encodeMetadata(back, "a.bwv"), text);
  EXPECT_EQ(back.metadata.others, info.metadata.others);
  EXPECT_EQ(back.channels[0].window, info.channels[0].window);
  ASSERT_EQ(back.channels[1].labels.size(), 3u);
  EXPECT_EQ(back.channels[1].labels[1].name, "left lung");
  EXPECT_EQ(back.channels[1].labels[1].color, info.channels[1].labels[1].color);
  EXPECT_EQ(back.channels[1].labels[2].value, 70000);
  EXPECT_FALSE(back.channels[1].labels[2].color.has_value());
}

TEST(Metadata, NothingKnownIsNoText) {
  const VolumeInfo info;
  EXPECT_EQ(encodeMetadata(info, "a.bwv"), "");
  VolumeInfo back;
  decodeMetadata("", 0, "a.bwv", back);
  EXPECT_TRUE(back.metadata.source_name.empty());
}

std::string refusalOf(const std::string& text) {
  VolumeInfo info;
  info.channels.resize(2);
  try {
    decodeMetadata(text, 1000, "a.bwv", info);
  } catch (const DataError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Metadata, ErrorsNameKeyOffsetAndBound) {
  EXPECT_THAT(refusalOf("source\tx"), HasSubstr("at offset 1000 must be lines that end with a line feed"));
  EXPECT_THAT(refusalOf("source\tx\nno tab\n"), HasSubstr("at offset 1009 must be a key"));
  EXPECT_THAT(refusalOf("Source\tx\n"), HasSubstr("must be a key"));
  EXPECT_THAT(refusalOf("\tx\n"), HasSubstr("must be a key"));
  EXPECT_THAT(refusalOf("source\t\n"), HasSubstr("metadata source at offset 1000 must be UTF-8"));
  EXPECT_THAT(refusalOf("source\ta\tb\n"), HasSubstr("without control characters"));
  EXPECT_THAT(refusalOf("source\t\xff\n"), HasSubstr("UTF-8"));
  EXPECT_THAT(refusalOf("new\tx\nnew\ty\n"), HasSubstr("metadata new at offset 1006 must be there once"));
  EXPECT_THAT(refusalOf("source\t" + std::string(1025, 'a') + "\n"), HasSubstr("at most 1024 bytes"));
  EXPECT_THAT(refusalOf("channel.0.name\t" + std::string(65, 'a') + "\n"), HasSubstr("at most 64 bytes"));
  for (const char* number : {"2", "x", "00", "", "-1"}) {
    EXPECT_THAT(refusalOf("channel." + std::string(number) + ".name\tx\n"), HasSubstr("of a channel below 2"));
  }
  for (const char* color : {"ff00", "ff00gg", "ff00ff0", "-f00ff"}) {
    EXPECT_THAT(refusalOf("channel.0.color\t" + std::string(color) + "\n"), HasSubstr("rrggbb"));
  }
  for (const char* window : {"1", "2 1", "nan 1", "0 inf", "0 1 2", "0  1"}) {
    EXPECT_THAT(refusalOf("channel.0.window\t" + std::string(window) + "\n"), HasSubstr("two finite numbers"));
  }
  EXPECT_THAT(refusalOf("channel.0.label.x\t- a\n"), HasSubstr("of a finite number"));
  EXPECT_THAT(refusalOf("channel.0.label.2\t- a\nchannel.0.label.1\t- a\n"), HasSubstr("above the label's before"));
  EXPECT_THAT(refusalOf("channel.0.label.2\tliver\n"), HasSubstr("rrggbb or -, and a name"));
}

TEST(Metadata, WhatCannotBeReadIsNotWritten) {
  VolumeInfo info;
  info.metadata.space = "two\nlines";
  EXPECT_THROW(encodeMetadata(info, "a.bwv"), DataError);
  info.metadata.space = std::string(1025, 'a');
  EXPECT_THROW(encodeMetadata(info, "a.bwv"), DataError);
}

}  // namespace
}  // namespace blockwalk::volume_test
