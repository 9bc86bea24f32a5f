// SPDX-License-Identifier: Apache-2.0
// The table of extreme cases: what is drawn, in words, the bound that its error must keep, and how it is measured.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace blockwalk::extreme {

enum class Unit {
  steps,     // 8-bit steps from the unrounded reference
  relative,  // of an optical depth
  wrong      // pixels or views that are wrong
};

// Rounding to 8 bits costs half a step, early ray termination at 1/1024 a quarter of one.
constexpr double kSteps = 1;

struct Case {
  std::string name;  // letters, digits and underscores
  std::string what;
  std::function<double()> measure;
  Unit unit = Unit::steps;
  double bound = kSteps;
};

std::vector<Case> depthCases();     // extinction and optical depth
std::vector<Case> valueCases();     // densities and ranges
std::vector<Case> rayCases();       // where rays run
std::vector<Case> cameraCases();    // where they start
std::vector<Case> shapeCases();     // dims, spacing, maps
std::vector<Case> transferCases();  // transfer functions
std::vector<Case> sizeCases();      // image sizes

}  // namespace blockwalk::extreme
