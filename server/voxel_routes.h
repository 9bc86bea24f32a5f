// SPDX-License-Identifier: Apache-2.0
// Paths of a volume that ask for numbers and reasons instead of its picture.
#pragma once

#include "server/asked.h"
#include "server/routes.h"

namespace blockwalk {

RouteResult answerRegion(const Asked& asked);
RouteResult answerSlice(const Asked& asked);
RouteResult answerExplain(const Asked& asked);
RouteResult answerPick(const Asked& asked);

}  // namespace blockwalk
