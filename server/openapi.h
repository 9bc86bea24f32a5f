// SPDX-License-Identifier: Apache-2.0
// The interface as an OpenAPI 3.1 document, from its tables of paths and of a view's members.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>

#include "server/routes.h"

namespace blockwalk {

nlohmann::json openApiJson(std::span<const Path> paths);

}  // namespace blockwalk
