// SPDX-License-Identifier: Apache-2.0
// MRC, MAP and CCP4 maps: Cheng et al. 2015, MRC2014.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace blockwalk {

constexpr std::size_t kMrcHeaderBytes = 1024;

// By the word MAP, or, as it is missing in old files, by what the numbers and the file's length say.
bool startsLikeMrc(std::span<const std::byte> start, std::uint64_t file_bytes);

}  // namespace blockwalk
