// SPDX-License-Identifier: Apache-2.0
// What is asked of an image beside its view.
#pragma once

#include <array>

#include "protocol/query_member.h"

namespace blockwalk {

constexpr int kMostDeadlineMs = 600000;

inline constexpr std::array kImageMembers = {
    QueryMember{"deadline_ms", "1..600000",
                "the best picture that is drawn by then, a coarse one at least; the reply says which (none)"}};

}  // namespace blockwalk
