// SPDX-License-Identifier: Apache-2.0
#include "volume/import/convert/half.h"

#include <gtest/gtest.h>

#include <limits>

namespace blockwalk {
namespace {

TEST(Half, EveryOneIsAFloatAndBack) {
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    const float value = floatFromHalf(static_cast<std::uint16_t>(bits));
    if (std::isnan(value)) {
      EXPECT_TRUE(std::isnan(floatFromHalf(halfFromFloat(value))));
    } else {
      EXPECT_EQ(halfFromFloat(value), bits) << value;
    }
  }
}

TEST(Half, OtherFloatsBecomeTheNearest) {
  EXPECT_EQ(halfFromFloat(0.1f), 0x2e66);
  EXPECT_EQ(halfFromFloat(1 + 0x1p-11f), 0x3c00) << "of two the even one";
  EXPECT_EQ(halfFromFloat(1 + 0x3p-11f), 0x3c02);
  EXPECT_EQ(halfFromFloat(2 - 0x1p-12f), 0x4000);
  EXPECT_EQ(halfFromFloat(0x1p-25f), 0);
  EXPECT_EQ(halfFromFloat(-0x1.8p-25f), 0x8001);
  EXPECT_EQ(halfFromFloat(65519), 0x7bff);
  EXPECT_EQ(halfFromFloat(-65520), 0xfc00);
  EXPECT_EQ(halfFromFloat(std::numeric_limits<float>::infinity()), 0x7c00);
}

}  // namespace
}  // namespace blockwalk
