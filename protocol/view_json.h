// SPDX-License-Identifier: Apache-2.0
// JSON members of a view in their text form, so that one parser reads flags, queries and messages.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace blockwalk {

// (name, text) of every member of `object` that `skip` does not name. Throws ViewError for a value that has no text
// form.
std::vector<std::pair<std::string, std::string>> viewFieldTexts(const nlohmann::json& object,
                                                                std::span<const std::string_view> skip = {});

}  // namespace blockwalk
