// SPDX-License-Identifier: Apache-2.0
#include "renderer/band_part.h"

#include <gtest/gtest.h>

#include <vector>

#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

// Parts that turn out to be too large now and then, down to a workgroup: everything is done once.
TEST(BandPart, PartsCoverTheBandOnce) {
  const Band band{.row_begin = 16, .row_count = 83, .column_begin = 8, .column_count = 201};
  for (int often = 1; often < 7; ++often) {
    std::vector<int> done(300 * 300);
    BandPart part(band);
    int tries = 0;
    bool more = true;
    while (more) {
      ASSERT_LT(++tries, 5000);
      const Band at = part.at();
      if (tries % often != 0) {
        const bool is_narrower = part.narrow();
        EXPECT_EQ(is_narrower, at.row_count > gpu::kGroupSide || at.column_count > gpu::kGroupSide);
        EXPECT_EQ(part.at().row_begin, at.row_begin);
        EXPECT_EQ(part.at().column_begin, at.column_begin);
        EXPECT_EQ(is_narrower, part.at().row_count * part.at().column_count < at.row_count * at.column_count);
        if (is_narrower) continue;
      }
      EXPECT_EQ((at.column_begin - band.column_begin) % gpu::kGroupSide, 0);
      EXPECT_EQ((at.row_begin - band.row_begin) % gpu::kGroupSide, 0);
      for (int y = at.row_begin; y < at.row_begin + at.row_count; ++y) {
        for (int x = at.column_begin; x < at.column_begin + at.column_count; ++x) {
          ++done[static_cast<std::size_t>(300 * y + x)];
        }
      }
      more = part.next();
    }
    for (int y = 0; y < 300; ++y) {
      for (int x = 0; x < 300; ++x) {
        const bool inside = y >= 16 && y < 16 + 83 && x >= 8 && x < 8 + 201;
        ASSERT_EQ(done[static_cast<std::size_t>(300 * y + x)], inside ? 1 : 0) << x << "," << y << " " << often;
      }
    }
  }
}

}  // namespace
}  // namespace blockwalk
