// SPDX-License-Identifier: Apache-2.0
// Colours of labels that nobody chose.
#pragma once

#include <vector>

#include "view/view.h"

namespace blockwalk {

// Labels that have a colour each; where values run further, labels between two of so many share theirs in parts.
constexpr int kMostLabelColors = 1024;

// A point for each label from the channel's least to its greatest, ascending: its own colour where the volume says one,
// else one that differs from its neighbours'. All are equally opaque.
std::vector<TransferPoint> labelTransfer(const ChannelInfo& channel);

}  // namespace blockwalk
