// SPDX-License-Identifier: Apache-2.0
#include "volume/formats/world_space.h"

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "volume/formats/text.h"

namespace blockwalk {
namespace {

struct Direction {
  std::string_view name;
  int axis;  // 0: to the right or left, 1: to the front or back, 2: up or down
  double sign;
};
constexpr std::array<Direction, 6> kDirections = {{{"right", 0, 1},
                                                   {"left", 0, -1},
                                                   {"anterior", 1, 1},
                                                   {"posterior", 1, -1},
                                                   {"superior", 2, 1},
                                                   {"inferior", 2, -1}}};

std::vector<std::string> wordsOf(std::string_view text) {
  const bool is_short = text.find('-') == std::string_view::npos && text.size() == 3;
  std::vector<std::string> parts;
  if (is_short) {
    for (const char letter : text) parts.emplace_back(1, letter);
    return parts;
  }
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('-', begin), text.size());
    parts.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

// The words in order; nothing where they are not one of each pair.
std::optional<std::array<Direction, 3>> directions(std::string_view text) {
  const auto parts = wordsOf(text);
  if (parts.size() != 3) return std::nullopt;
  std::array<Direction, 3> found{};
  unsigned axes = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (const Direction& direction : kDirections) {
      const bool is_it = parts[i] == direction.name || (parts[i].size() == 1 && parts[i][0] == direction.name[0]);
      if (!is_it) continue;
      found[i] = direction;
      axes |= 1u << direction.axis;
    }
  }
  return axes == 7 ? std::optional(found) : std::nullopt;
}

std::string_view opposite(const Direction& direction) {
  for (const Direction& other : kDirections) {
    if (other.axis == direction.axis && other.sign != direction.sign) return other.name;
  }
  return direction.name;
}

std::string_view withoutTime(std::string_view text) {
  constexpr std::string_view kTime = "-time";
  if (text.ends_with(kTime)) return text.substr(0, text.size() - kTime.size());
  return text.size() == 4 && text.ends_with('t') ? text.substr(0, 3) : text;
}

}  // namespace

WorldSpace worldSpace(std::string_view said) {
  const std::string lower = lowerCase(trimmed(said));
  const std::string_view text = withoutTime(lower);
  if (text == "3d-left-handed" || text == "3dlh") return {.name = "3D-right-handed", .is_left_handed = true};
  if (text == "3d-right-handed" || text == "3drh") return {.name = "3D-right-handed"};
  if (text == "scanner-xyz") return {.name = "scanner-xyz"};
  const auto found = directions(text);
  if (!found) return {.name = std::string(said)};
  glm::dmat3 axes(0);
  for (int i = 0; i < 3; ++i)
    axes[i][(*found)[static_cast<std::size_t>(i)].axis] = (*found)[static_cast<std::size_t>(i)].sign;
  const bool is_left = glm::determinant(axes) < 0;
  std::string name(is_left ? opposite((*found)[0]) : (*found)[0].name);
  for (const std::size_t i : {1, 2}) name.append("-").append((*found)[i].name);
  if (is_left) axes[0] = -axes[0];
  return {name, is_left, axes};
}

}  // namespace blockwalk
