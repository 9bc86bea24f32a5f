// SPDX-License-Identifier: Apache-2.0
#include "clients/cli/flag_values.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "clients/cli/usage_error.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

template <typename T>
std::optional<T> wholeNumber(std::string_view text) {
  T value{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

constexpr std::array<std::string_view, 5> kUnits = {"B", "KiB", "MiB", "GiB", "TiB"};

}  // namespace

std::uint64_t parseByteSize(std::string_view flag, std::string_view text) {
  const std::size_t unit_begin = std::min(text.find_first_not_of("0123456789"), text.size());
  const auto count = wholeNumber<std::uint64_t>(text.substr(0, unit_begin));
  const std::string_view unit = text.substr(unit_begin);
  int shift = unit.empty() ? 0 : -1;
  for (std::size_t i = 0; i < kUnits.size(); ++i) {
    if (unit == kUnits[i]) shift = static_cast<int>(10 * i);
  }
  if (!count || shift < 0 || (*count << shift >> shift) != *count) {
    throw UsageError(fmt::format("{}: '{}' is no size; write 2GiB, 512MiB, 64KiB or a number of bytes", flag, text));
  }
  return *count << shift;
}

glm::ivec3 parseDims(std::string_view flag, std::string_view text) {
  const auto parts = split(text, 'x');
  glm::ivec3 dims{0};
  for (std::size_t i = 0; i < parts.size() && parts.size() == 3; ++i) {
    dims[static_cast<int>(i)] = wholeNumber<int>(parts[i]).value_or(0);
  }
  if (glm::any(glm::lessThan(dims, glm::ivec3(1))) || glm::any(glm::greaterThan(dims, glm::ivec3(kMaxDim)))) {
    throw UsageError(fmt::format("{}: '{}' must be XxYxZ, each 1..{}", flag, text, kMaxDim));
  }
  return dims;
}

VoxelBox parseBox(std::string_view flag, std::string_view text) {
  const auto parts = split(text, ',');
  VoxelBox box;
  bool is_right = parts.size() == 6;
  for (std::size_t i = 0; i < 6 && is_right; ++i) {
    const int number = wholeNumber<int>(parts[i]).value_or(-1);
    is_right = number >= 0 && number <= kMaxDim;
    (i < 3 ? box.begin : box.end)[static_cast<int>(i % 3)] = number;
  }
  if (!is_right || glm::any(glm::greaterThanEqual(box.begin, box.end))) {
    throw UsageError(fmt::format("{}: '{}' must be x0,y0,z0,x1,y1,z1, each 0..{}, the first three below the others",
                                 flag, text, kMaxDim));
  }
  return box;
}

glm::dvec3 parseSpacing(std::string_view flag, std::string_view text) {
  const auto parts = split(text, ',');
  glm::dvec3 spacing{0};
  if (parts.size() == 1 || parts.size() == 3) {
    for (std::size_t i = 0; i < 3; ++i) {
      spacing[static_cast<int>(i)] = wholeNumber<double>(parts[parts.size() == 1 ? 0 : i]).value_or(0);
    }
  }
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(spacing[i]) || !(spacing[i] > 0)) {
      throw UsageError(fmt::format("{}: '{}' must be x,y,z, each finite and above 0", flag, text));
    }
  }
  return spacing;
}

std::string byteText(std::uint64_t bytes) {
  std::size_t unit = 0;
  double value = static_cast<double>(bytes);
  while (value >= 1024 && unit + 1 < kUnits.size()) {
    value /= 1024;
    ++unit;
  }
  return unit == 0 ? fmt::format("{} B", bytes) : fmt::format("{:.2f} {}", value, kUnits[unit]);
}

}  // namespace blockwalk
