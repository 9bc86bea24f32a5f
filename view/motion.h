// SPDX-License-Identifier: Apache-2.0
// Where a view that moves is about to be.
#pragma once

#include <optional>

#include "view/resolved_view.h"

namespace blockwalk {

// `now`, if its camera moves on as it has since `before`, so many times: turned and shifted as a rigid body is, which
// any turn about a point and any shift is, and its picture's width by the same factor. Nothing where it has not moved,
// or is another view in anything else but its size.
std::optional<ResolvedView> movedOn(const ResolvedView& before, const ResolvedView& now, int times);

}  // namespace blockwalk
