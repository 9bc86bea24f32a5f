// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <string>

namespace blockwalk {

// A stream's view message; `members` are JSON.
inline std::string viewMessage(int id, const std::string& members = R"("size":[64,48])") {
  return fmt::format(R"({{"type":"view","id":{},{}}})", id, members);
}

}  // namespace blockwalk
