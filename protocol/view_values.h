// SPDX-License-Identifier: Apache-2.0
// The text forms of a view's values. Parsers take the whole text or throw ViewError naming `field` and the bound;
// nothing is trimmed, clamped or guessed. Writers give the shortest text that parses back to the same value.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "view/view.h"

namespace blockwalk {

constexpr std::size_t kMaxTransferPoints = 1024;

// Throws ViewError("field", "field: detail, not 'text'"); the text is shortened and made printable.
[[noreturn]] void failValue(std::string_view field, std::string_view detail, std::string_view text);

// Throws ViewError("field", "field: detail"): of a name that is wrong whatever its value is.
[[noreturn]] void failName(std::string_view field, std::string_view detail);

double parseNumber(std::string_view field, std::string_view text);  // finite
int parseInteger(std::string_view field, std::string_view text, int lo, int hi);
bool parseSwitch(std::string_view field, std::string_view text);  // on, off
// The items of a member that has one a channel, separated by ;. At most kMaxChannels.
std::vector<std::string_view> splitChannels(std::string_view field, std::string_view text);
std::vector<int> parseChannels(std::string_view field, std::string_view text);  // 0,2: no repeats
glm::dvec3 parseVector(std::string_view field, std::string_view text);
Lights parseLights(std::string_view field, std::string_view text);                      // ambient,head,key,highlight
DensityRange parseRange(std::string_view field, std::string_view text);                 // lo:hi
ClipBox parseClip(std::string_view field, std::string_view text);                       // x0,y0,z0,x1,y1,z1
std::vector<ClipPlane> parsePlanes(std::string_view field, std::string_view text);      // nx,ny,nz,d;...
std::array<std::uint8_t, 4> parseColor(std::string_view field, std::string_view text);  // rrggbb or rrggbbaa
std::vector<TransferPoint> parseTransfer(std::string_view field, std::string_view text);

std::string numberText(double value);
std::string rangeText(const DensityRange& range);
std::string channelsText(const std::vector<int>& channels);
std::string vectorText(const glm::dvec3& value);
std::string lightsText(const Lights& lights);
std::string planesText(const std::vector<ClipPlane>& planes);
std::string colorText(const std::array<std::uint8_t, 4>& color);
std::string transferText(const std::vector<TransferPoint>& points);

}  // namespace blockwalk
