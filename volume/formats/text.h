// SPDX-License-Identifier: Apache-2.0
// Words and numbers of texts, strictly, and without the locale.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace blockwalk {

// A text for people that is longer is no name of a unit, and left out.
constexpr std::size_t kMaxUnitBytes = 64;

std::string_view trimmed(std::string_view text);
std::vector<std::string_view> words(std::string_view text);
std::string lowerCase(std::string_view text);

// The whole text as a number; nothing where it is none.
std::optional<std::int64_t> parseInteger(std::string_view text);
std::optional<double> parseReal(std::string_view text);  // accepts nan and inf

}  // namespace blockwalk
