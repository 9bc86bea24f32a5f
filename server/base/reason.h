// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <string>

namespace blockwalk {

// What was thrown, in words: for the log, where it was no request that failed (that is problemOf(),
// server/http/problem.h).
std::string reasonOf(const std::exception_ptr& thrown);

}  // namespace blockwalk
