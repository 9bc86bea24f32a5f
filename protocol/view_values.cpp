// SPDX-License-Identifier: Apache-2.0
#include "protocol/view_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace blockwalk {
namespace {

constexpr std::size_t kShownText = 40;

// What a client sent is shown back shortened and printable, so that a message never carries control bytes.
std::string shownText(std::string_view text) {
  std::string shown;
  for (char c : text.substr(0, kShownText)) shown += c >= ' ' && c <= '~' ? c : '?';
  if (text.size() > kShownText) shown += "...";
  return shown;
}

// The parts of `text` between separators; throws unless there are between `lo` and `hi` of them.
std::vector<std::string_view> splitParts(std::string_view field, std::string_view text, char separator, std::size_t lo,
                                         std::size_t hi, std::string_view form) {
  std::vector<std::string_view> parts;
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(text.substr(begin, end - begin));
    if (end == std::string_view::npos) break;
    if (parts.size() == hi) failValue(field, fmt::format("must be {}", form), text);
    begin = end + 1;
  }
  if (parts.size() < lo) failValue(field, fmt::format("must be {}", form), text);
  return parts;
}

std::uint8_t parseHexByte(std::string_view field, std::string_view text, std::size_t offset) {
  unsigned value = 0;
  const char* begin = text.data() + offset;
  const auto [end, error] = std::from_chars(begin, begin + 2, value, 16);
  if (error != std::errc() || end != begin + 2) failValue(field, "must be hexadecimal rrggbb or rrggbbaa", text);
  return static_cast<std::uint8_t>(value);
}

std::uint8_t colorByte(double component) { return static_cast<std::uint8_t>(std::lround(component * 255)); }

}  // namespace

void failValue(std::string_view field, std::string_view detail, std::string_view text) {
  throw ViewError(shownText(field), fmt::format("{}: {}, not '{}'", shownText(field), detail, shownText(text)));
}

void failName(std::string_view field, std::string_view detail) {
  throw ViewError(shownText(field), fmt::format("{}: {}", shownText(field), detail));
}

double parseNumber(std::string_view field, std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range) failValue(field, "must fit a double", text);
  if (error != std::errc() || end != text.data() + text.size()) failValue(field, "must be a number", text);
  if (!std::isfinite(value)) failValue(field, "must be finite", text);
  return value;
}

int parseInteger(std::string_view field, std::string_view text, int lo, int hi) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = end == text.data() + text.size();
  if (error != std::errc() || !whole || value < lo || value > hi) {
    failValue(field, fmt::format("must be a whole number from {} to {}", lo, hi), text);
  }
  return value;
}

bool parseSwitch(std::string_view field, std::string_view text) {
  if (text == "on") return true;
  if (text == "off") return false;
  failValue(field, "must be on or off", text);
}

std::vector<std::string_view> splitChannels(std::string_view field, std::string_view text) {
  static_assert(kMaxChannels == 4);
  return splitParts(field, text, ';', 1, kMaxChannels, "at most 4 items, one a channel, separated by ;");
}

std::vector<int> parseChannels(std::string_view field, std::string_view text) {
  std::vector<int> channels;
  for (std::string_view part : splitParts(field, text, ',', 1, kMaxChannels, "1 to 4 channels, comma separated")) {
    const int channel = parseInteger(field, part, 0, kMaxChannels - 1);
    if (std::ranges::find(channels, channel) != channels.end()) failValue(field, "must name a channel once", text);
    channels.push_back(channel);
  }
  return channels;
}

glm::dvec3 parseVector(std::string_view field, std::string_view text) {
  const auto parts = splitParts(field, text, ',', 3, 3, "three numbers x,y,z");
  return {parseNumber(field, parts[0]), parseNumber(field, parts[1]), parseNumber(field, parts[2])};
}

Lights parseLights(std::string_view field, std::string_view text) {
  const auto parts = splitParts(field, text, ',', 4, 4, "four numbers ambient,head,key,highlight");
  return {.ambient = parseNumber(field, parts[0]),
          .head = parseNumber(field, parts[1]),
          .key = parseNumber(field, parts[2]),
          .highlight = parseNumber(field, parts[3])};
}

DensityRange parseRange(std::string_view field, std::string_view text) {
  const auto parts = splitParts(field, text, ':', 2, 2, "lo:hi");
  const DensityRange range{parseNumber(field, parts[0]), parseNumber(field, parts[1])};
  if (range.lo > range.hi) failValue(field, "must be lo:hi with lo <= hi", text);
  return range;
}

ClipBox parseClip(std::string_view field, std::string_view text) {
  const auto parts = splitParts(field, text, ',', 6, 6, "six numbers x0,y0,z0,x1,y1,z1");
  ClipBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<std::size_t>(axis);
    box.min[axis] = parseNumber(field, parts[low]);
    box.max[axis] = parseNumber(field, parts[low + 3]);
    if (box.min[axis] > box.max[axis]) failValue(field, "must have x0 <= x1, y0 <= y1 and z0 <= z1", text);
  }
  return box;
}

std::vector<ClipPlane> parsePlanes(std::string_view field, std::string_view text) {
  constexpr std::string_view kForm = "1 to 6 planes nx,ny,nz,d, separated by ;";
  static_assert(kMaxPlanes == 6);
  std::vector<ClipPlane> planes;
  for (std::string_view part : splitParts(field, text, ';', 1, kMaxPlanes, kForm)) {
    const auto numbers = splitParts(field, part, ',', 4, 4, "four numbers nx,ny,nz,d a plane");
    ClipPlane plane;
    for (int axis = 0; axis < 3; ++axis) {
      plane.normal[axis] = parseNumber(field, numbers[static_cast<std::size_t>(axis)]);
    }
    plane.offset = parseNumber(field, numbers[3]);
    if (plane.normal == glm::dvec3(0)) failValue(field, "must have normals that are not 0", part);
    planes.push_back(plane);
  }
  return planes;
}

std::array<std::uint8_t, 4> parseColor(std::string_view field, std::string_view text) {
  if (text.size() != 6 && text.size() != 8) failValue(field, "must be hexadecimal rrggbb or rrggbbaa", text);
  std::array<std::uint8_t, 4> color{0, 0, 0, 255};
  for (std::size_t i = 0; i < text.size() / 2; ++i) color[i] = parseHexByte(field, text, 2 * i);
  return color;
}

std::vector<TransferPoint> parseTransfer(std::string_view field, std::string_view text) {
  constexpr std::string_view kForm = "1 to 1024 points value:rrggbb:opacity, comma separated";
  std::vector<TransferPoint> points;
  for (std::string_view part : splitParts(field, text, ',', 1, kMaxTransferPoints, kForm)) {
    const auto members = splitParts(field, part, ':', 3, 3, kForm);
    if (members[1].size() != 6) failValue(field, "must have colours as rrggbb", part);
    const auto color = parseColor(field, members[1]);
    const TransferPoint point{.value = parseNumber(field, members[0]),
                              .color = glm::dvec3(color[0], color[1], color[2]) / 255.0,
                              .opacity = parseNumber(field, members[2])};
    if (point.opacity < 0 || point.opacity > 1) failValue(field, "must have opacities from 0 to 1", part);
    if (!points.empty() && point.value <= points.back().value) failValue(field, "must have ascending values", part);
    points.push_back(point);
  }
  return points;
}

std::string numberText(double value) {
  std::array<char, 32> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  BLOCKWALK_CHECK(static_cast<int>(error), ==, 0);
  return {text.data(), end};
}

std::string rangeText(const DensityRange& range) { return numberText(range.lo) + ":" + numberText(range.hi); }

std::string channelsText(const std::vector<int>& channels) { return fmt::format("{}", fmt::join(channels, ",")); }

std::string vectorText(const glm::dvec3& value) {
  return numberText(value.x) + "," + numberText(value.y) + "," + numberText(value.z);
}

std::string lightsText(const Lights& lights) {
  return vectorText({lights.ambient, lights.head, lights.key}) + "," + numberText(lights.highlight);
}

std::string planesText(const std::vector<ClipPlane>& planes) {
  std::string text;
  for (const ClipPlane& plane : planes) {
    if (!text.empty()) text += ';';
    text += vectorText(plane.normal) + "," + numberText(plane.offset);
  }
  return text;
}

std::string colorText(const std::array<std::uint8_t, 4>& color) {
  std::string text = fmt::format("{:02x}{:02x}{:02x}", color[0], color[1], color[2]);
  if (color[3] != 255) text += fmt::format("{:02x}", color[3]);
  return text;
}

std::string transferText(const std::vector<TransferPoint>& points) {
  std::string text;
  for (const TransferPoint& point : points) {
    if (!text.empty()) text += ',';
    text += fmt::format("{}:{:02x}{:02x}{:02x}:{}", numberText(point.value), colorByte(point.color.r),
                        colorByte(point.color.g), colorByte(point.color.b), numberText(point.opacity));
  }
  return text;
}

}  // namespace blockwalk
