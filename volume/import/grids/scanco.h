// SPDX-License-Identifier: Apache-2.0
// Scanco's micro-CT: ISQ and AIM.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace blockwalk {

bool startsLikeIsq(std::span<const std::byte> start);
bool startsLikeAim(std::span<const std::byte> start);

}  // namespace blockwalk
