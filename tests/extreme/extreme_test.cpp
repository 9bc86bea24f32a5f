// SPDX-License-Identifier: Apache-2.0
// Runs the table of extreme cases. Prints a Markdown row a case: docs/accuracy.md holds `test_extreme | grep '^|'`.
#include <cmath>

#include "tests/extreme/cases.h"
#include "tests/renderer/stage.h"

namespace blockwalk::extreme {

void PrintTo(const Case& extreme_case, std::ostream* out) { *out << extreme_case.name; }

namespace {

class ExtremeTest : public test::RendererTest, public ::testing::WithParamInterface<Case> {};

const char* toString(Unit unit) {
  switch (unit) {
    case Unit::steps:
      return "steps";
    case Unit::relative:
      return "relative";
    case Unit::wrong:
      return "wrong";
  }
  return "";
}

TEST_P(ExtremeTest, KeepsItsBound) {
  const Case& extreme_case = GetParam();
  const double error = extreme_case.measure();
  EXPECT_TRUE(std::isfinite(error));
  EXPECT_LE(error, extreme_case.bound) << extreme_case.what;
  std::printf("| %s | %s | %s | %g | %.3g |\n", extreme_case.name.c_str(), extreme_case.what.c_str(),
              toString(extreme_case.unit), extreme_case.bound, error);
}

std::string caseName(const ::testing::TestParamInfo<Case>& info) { return info.param.name; }

INSTANTIATE_TEST_SUITE_P(Depth, ExtremeTest, ::testing::ValuesIn(depthCases()), caseName);
INSTANTIATE_TEST_SUITE_P(Value, ExtremeTest, ::testing::ValuesIn(valueCases()), caseName);
INSTANTIATE_TEST_SUITE_P(Ray, ExtremeTest, ::testing::ValuesIn(rayCases()), caseName);
INSTANTIATE_TEST_SUITE_P(Camera, ExtremeTest, ::testing::ValuesIn(cameraCases()), caseName);
INSTANTIATE_TEST_SUITE_P(Shape, ExtremeTest, ::testing::ValuesIn(shapeCases()), caseName);
INSTANTIATE_TEST_SUITE_P(Transfer, ExtremeTest, ::testing::ValuesIn(transferCases()), caseName);
INSTANTIATE_TEST_SUITE_P(Size, ExtremeTest, ::testing::ValuesIn(sizeCases()), caseName);

}  // namespace
}  // namespace blockwalk::extreme
