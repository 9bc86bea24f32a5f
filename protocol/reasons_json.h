// SPDX-License-Identifier: Apache-2.0
// Why a picture is empty or coarse, as JSON: [{"reason", "detail", "change"}], `change` as members of a view.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "view/reasons.h"

namespace blockwalk {

nlohmann::json reasonsJson(std::span<const Reason> reasons);

// The way back, for clients in C++. Throws nlohmann's exceptions where it is something else.
std::vector<Reason> readReasons(const nlohmann::json& reasons);

}  // namespace blockwalk
