// SPDX-License-Identifier: Apache-2.0
// Which pixel of a view's picture is asked what it shows.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/query_member.h"
#include "protocol/view_fields.h"
#include "view/frame.h"

namespace blockwalk {

inline constexpr std::array kPickMembers = {QueryMember{"x", "N", "the pixel, from the left, from 0", true},
                                            QueryMember{"y", "N", "the pixel, from the top, from 0", true}};

struct PickRequest {
  View view;            // with the output and samples that a pixel's point needs
  glm::ivec2 pixel{0};  // from the left and the top
};

// From the members of a query: those of a view, and x and y. Throws ViewError naming the member and the bound: unknown,
// repeated, missing, or out of bounds.
PickRequest readPickRequest(const std::vector<std::pair<std::string, std::string>>& members);

// {"hit": true, "voxel", "world", "t", "level", "values"}, `values` one a channel, null for none; or {"hit": false}.
nlohmann::json pickJson(const std::optional<ShownPoint>& shown, const std::vector<std::optional<double>>& values);

}  // namespace blockwalk
