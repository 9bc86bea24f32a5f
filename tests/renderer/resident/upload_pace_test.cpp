// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/upload_pace.h"

#include <gtest/gtest.h>

namespace blockwalk {
namespace {

// A device that takes so many bytes a microsecond, and the longest piece once the pace has had time to settle.
UploadPace::Time longestPiece(std::uint64_t bytes_a_microsecond, int pieces) {
  UploadPace pace;
  UploadPace::Time longest{0};
  for (int i = 0; i < pieces; ++i) {
    const UploadPace::Time time(static_cast<UploadPace::Time::rep>(pace.bytes() / bytes_a_microsecond));
    if (i >= 10) longest = std::max(longest, time);
    pace.took(pace.bytes(), time);
  }
  return longest;
}

TEST(UploadPace, PiecesKeepTheDeadlineOfSlowDevicesAndFast) {
  for (const std::uint64_t speed : {300u, 1000u, 3000u, 10000u, 100000u}) {
    EXPECT_LE(longestPiece(speed, 40), UploadPace::kDeadline) << speed;
  }
}

TEST(UploadPace, AFastDeviceTakesAsMuchAsItMay) {
  UploadPace pace;
  for (int i = 0; i < 10; ++i) pace.took(pace.bytes(), UploadPace::Time(1));
  EXPECT_EQ(pace.bytes(), UploadPace::kMost);
}

TEST(UploadPace, NeverComesToAStandstillAndRecovers) {
  UploadPace pace;
  for (int i = 0; i < 40; ++i) pace.took(pace.bytes(), UploadPace::Time(1'000'000));
  EXPECT_EQ(pace.bytes(), UploadPace::kLeast);
  for (int i = 0; i < 2; ++i) pace.took(pace.bytes(), UploadPace::Time(1));
  EXPECT_EQ(pace.bytes(), UploadPace::kFirst);
}

TEST(UploadPace, AFewBytesSayNothingOfMany) {
  UploadPace pace;
  pace.took(1000, UploadPace::Time(1));
  EXPECT_EQ(pace.bytes(), UploadPace::kFirst);
}

}  // namespace
}  // namespace blockwalk
