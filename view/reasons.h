// SPDX-License-Identifier: Apache-2.0
// Why a picture shows nothing, or is coarser than it was asked to be, and what of the view to change. Plain data, no
// Vulkan.
#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "view/resolved_view.h"

namespace blockwalk {

struct RenderStats;

// A member of a view, by its name on the wire, and what it should be: a number, or a word like `auto`.
struct ViewChange {
  std::string member;
  std::variant<double, std::string> value;
  bool operator==(const ViewChange&) const = default;
};

struct Reason {
  // camera, clip, range, tf, extinction, iso, channels, level, loading, unseen (docs/protocol.md)
  std::string name;
  std::string detail;              // a sentence for people
  std::vector<ViewChange> change;  // what would help, all of it together; empty: nothing of the view would
  bool operator==(const Reason&) const = default;
};

// Why nothing of the volume can be seen, as far as that is certain without drawing it; each reason alone is enough.
std::vector<Reason> reasonsForNothing(const ResolvedView& view, const VolumeInfo& info);

// Of a frame of that view: those above where no pixel shows anything, `unseen` where none of them holds, and what a
// frame knows of its level. None of a picture that shows something, and as finely as it was asked to.
std::vector<Reason> reasonsOf(const ResolvedView& view, const VolumeInfo& info, const RenderStats& stats);

}  // namespace blockwalk
