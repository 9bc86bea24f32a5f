// SPDX-License-Identifier: Apache-2.0
#include "view/first_look.h"

#include <array>
#include <optional>
#include <string_view>

namespace blockwalk {
namespace {

// Which of left, anterior, superior a word is, and on which side: nothing for other words.
struct Towards {
  int which = 0;
  double sign = 1;
};
std::optional<Towards> towards(std::string_view word) {
  constexpr std::array<std::string_view, 3> kPlus{"left", "anterior", "superior"};
  constexpr std::array<std::string_view, 3> kMinus{"right", "posterior", "inferior"};
  for (int which = 0; which < 3; ++which) {
    if (word == kPlus[static_cast<std::size_t>(which)]) return Towards{which, 1};
    if (word == kMinus[static_cast<std::size_t>(which)]) return Towards{which, -1};
  }
  return std::nullopt;
}

}  // namespace

FirstLook firstLook(const std::string& space) {
  std::array<glm::dvec3, 3> directions{glm::dvec3(0), glm::dvec3(0), glm::dvec3(0)};  // left, anterior, superior
  std::string_view rest = space;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t end = rest.find('-');
    const std::optional<Towards> found = towards(rest.substr(0, end));
    if (!found || directions[static_cast<std::size_t>(found->which)] != glm::dvec3(0)) return {};
    directions[static_cast<std::size_t>(found->which)][axis] = found->sign;
    rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
  }
  return {.up = directions[2], .from = 0.7 * directions[0] + 1.2 * directions[1] + 0.6 * directions[2]};
}

}  // namespace blockwalk
