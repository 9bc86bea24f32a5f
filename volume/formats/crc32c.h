// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace blockwalk {

// CRC-32C (Castagnoli) as RFC 3720 has it.
std::uint32_t crc32c(std::span<const std::byte> bytes);

}  // namespace blockwalk
