// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace blockwalk {

// A member of a query that is not a view's, for who describes it.
struct QueryMember {
  std::string_view name;
  std::string_view value;  // how to write it
  std::string_view help;
  bool required = false;
};

}  // namespace blockwalk
