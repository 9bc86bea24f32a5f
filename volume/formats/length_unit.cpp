// SPDX-License-Identifier: Apache-2.0
#include "volume/formats/length_unit.h"

#include <array>

#include "volume/formats/text.h"

namespace blockwalk {
namespace {

struct KnownUnit {
  std::string_view said;
  std::string_view name;
  double metres;
};

// Both signs that look like the Greek letter, the byte that Latin-1 has for it, and how Java escapes it.
constexpr std::array<KnownUnit, 41> kKnownUnits = {{{"\xc2\xb5m", "um", 1e-6},
                                                    {"\xce\xbcm", "um", 1e-6},
                                                    {"\xb5m", "um", 1e-6},
                                                    {"\\u00B5m", "um", 1e-6},
                                                    {"\\u00b5m", "um", 1e-6},
                                                    {"um", "um", 1e-6},
                                                    {"micron", "um", 1e-6},
                                                    {"microns", "um", 1e-6},
                                                    {"micrometer", "um", 1e-6},
                                                    {"micrometre", "um", 1e-6},
                                                    {"micrometers", "um", 1e-6},
                                                    {"pm", "pm", 1e-12},
                                                    {"picometer", "pm", 1e-12},
                                                    {"\xc3\x85", "angstrom", 1e-10},
                                                    {"\\u00C5", "angstrom", 1e-10},
                                                    {"A", "angstrom", 1e-10},
                                                    {"angstrom", "angstrom", 1e-10},
                                                    {"nm", "nm", 1e-9},
                                                    {"nanometer", "nm", 1e-9},
                                                    {"mm", "mm", 1e-3},
                                                    {"millimeter", "mm", 1e-3},
                                                    {"cm", "cm", 1e-2},
                                                    {"centimeter", "cm", 1e-2},
                                                    {"dm", "dm", 1e-1},
                                                    {"decimeter", "dm", 1e-1},
                                                    {"m", "m", 1},
                                                    {"meter", "m", 1},
                                                    {"metre", "m", 1},
                                                    {"km", "km", 1e3},
                                                    {"kilometer", "km", 1e3},
                                                    {"in", "in", 0.0254},
                                                    {"inch", "in", 0.0254},
                                                    {"inches", "in", 0.0254},
                                                    {"ft", "ft", 0.3048},
                                                    {"foot", "ft", 0.3048},
                                                    {"yd", "yd", 0.9144},
                                                    {"yard", "yd", 0.9144},
                                                    {"mi", "mi", 1609.344},
                                                    {"thou", "thou", 2.54e-5},
                                                    {"mil", "thou", 2.54e-5},
                                                    {"pt", "pt", 0.0254 / 72}}};

}  // namespace

LengthUnit lengthUnit(std::string_view said) {
  const std::string_view text = trimmed(said);
  for (const std::string_view none : {"pixel", "pixels", "voxel", "reference frame", "?", "unknown"}) {
    if (text == none) return {};
  }
  for (const KnownUnit& unit : kKnownUnits) {
    if (text == unit.said) return {std::string(unit.name), unit.metres};
  }
  if (text.size() > kMaxUnitBytes) return {};
  return {std::string(text), 0};
}

double factorBetween(const LengthUnit& from, const LengthUnit& to) {
  if (from.name == to.name) return 1;
  return from.metres > 0 && to.metres > 0 ? from.metres / to.metres : 0;
}

}  // namespace blockwalk
