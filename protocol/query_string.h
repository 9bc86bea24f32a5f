// SPDX-License-Identifier: Apache-2.0
// `a=b&c=d` of a URL as (name, text) pairs.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "volume/error.h"

namespace blockwalk {

constexpr std::size_t kMaxQueryPairs = 64;

// Decodes %hh and `+` (a space, as browsers write it). Order and repeats are kept: judging them is the caller's.
// Throws DataError for a broken escape, a member without `=`, an empty name, or more than kMaxQueryPairs members.
std::vector<std::pair<std::string, std::string>> parseQueryString(std::string_view query);

// The other way; what is none of A-Z a-z 0-9 - . _ ~ : , ; becomes %hh.
std::string queryText(const std::vector<std::pair<std::string, std::string>>& pairs);

}  // namespace blockwalk
