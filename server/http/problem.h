// SPDX-License-Identifier: Apache-2.0
// What was thrown, as clients are told of it.
#pragma once

#include <exception>

#include "protocol/problem.h"
#include "server/http/message.h"

namespace blockwalk {

// The problem that stands for what was thrown while a request was served.
Problem problemOf(std::exception_ptr error);
// A refusal, with Retry-After where another try may help.
HttpReply failureReply(const Problem& problem);

}  // namespace blockwalk
