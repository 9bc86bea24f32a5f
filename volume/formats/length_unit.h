// SPDX-License-Identifier: Apache-2.0
// Units of length as microscopes, scanners and programs write them.
#pragma once

#include <string>
#include <string_view>

namespace blockwalk {

struct LengthUnit {
  std::string name;   // as volumes say it: mm, um; as it was said where it is not known; empty: it is no length
  double metres = 0;  // 0: not known
};

LengthUnit lengthUnit(std::string_view said);

// How many of unit `to` one of `from` is; 0 where that is not known.
double factorBetween(const LengthUnit& from, const LengthUnit& to);

}  // namespace blockwalk
