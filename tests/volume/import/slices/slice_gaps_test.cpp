// SPDX-License-Identifier: Apache-2.0
#include "tests/volume/import/import_scratch.h"
#include "volume/import/slices/slice_order.h"

namespace blockwalk {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> gapsOf(std::initializer_list<const char*> names) {
  std::vector<std::string> notes;
  noteGaps(std::vector<std::filesystem::path>(names.begin(), names.end()), notes);
  return notes;
}

TEST(SliceGaps, AreToldWhereNumbersAreMissing) {
  EXPECT_THAT(gapsOf({"s1.tif", "s2.tif", "s3.tif", "s5.tif"}), ElementsAre(HasSubstr("number 4;")));
  EXPECT_THAT(gapsOf({"s01.tif", "s02.tif", "s06.tif", "s07.tif", "s08.tif", "s10.tif"}),
              ElementsAre(AllOf(HasSubstr("number 3 to 5, 9;"), HasSubstr("the 6 that are there"))));
  EXPECT_THAT(gapsOf({"a10", "a20", "a40", "a50"}), ElementsAre(HasSubstr("number 30;")));
  EXPECT_THAT(gapsOf({"a10", "a20", "a30", "a35"}), ElementsAre(HasSubstr("a35 is numbered 35, in steps of 10")));
  EXPECT_THAT(gapsOf({"a1", "a2", "a02", "a3"}), ElementsAre(HasSubstr("a02 has the number of the slice before it")));
}

TEST(SliceGaps, ARegularStepIsNone) {
  EXPECT_THAT(gapsOf({"s1.tif", "s2.tif", "s3.tif"}), IsEmpty());
  EXPECT_THAT(gapsOf({"s1.tif", "s3.tif", "s5.tif"}), IsEmpty());
  EXPECT_THAT(gapsOf({"s1.tif", "s9.tif"}), IsEmpty());
  EXPECT_THAT(gapsOf({"only.tif"}), IsEmpty());
  EXPECT_THAT(gapsOf({"a.tif", "b.tif", "c.tif"}), IsEmpty());
  EXPECT_THAT(gapsOf({"x1_7.tif", "x1_8.tif", "x1_9.tif"}), IsEmpty());
  EXPECT_THAT(gapsOf({"x1_7.tif", "x2_9.tif", "x3_20.tif"}), IsEmpty()) << "nobody knows which number counts";
  EXPECT_THAT(gapsOf({"s99999999999999999999.tif", "s1.tif", "s5.tif"}), IsEmpty());
}

}  // namespace
}  // namespace blockwalk
