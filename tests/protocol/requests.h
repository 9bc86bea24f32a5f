// SPDX-License-Identifier: Apache-2.0
// A request for an image from the text of its query or of its JSON object.
#pragma once

#include <nlohmann/json.hpp>
#include <string_view>

#include "protocol/query_string.h"
#include "protocol/view_fields.h"

namespace blockwalk {

inline ImageRequest fromQuery(std::string_view query) {
  ImageRequest request;
  setViewFields(request, parseQueryString(query));
  return request;
}

inline ImageRequest fromJson(std::string_view text) {
  ImageRequest request;
  setViewFields(request, nlohmann::json::parse(text));
  return request;
}

}  // namespace blockwalk
