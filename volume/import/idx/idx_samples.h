// SPDX-License-Identifier: Apache-2.0
// Samples of any width, moved between the order of codes and rows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "volume/import/convert/sample.h"
#include "volume/import/idx/idx_bits.h"

namespace blockwalk {

// Of the lattice that the bits [begin, end) of codes tell apart: where each lies in rows of x, then y, then z, by the
// value of those bits.
std::vector<std::uint32_t> rowsOfCodes(const IdxBits& bits, int begin, int end);

// Codes first, first + step and so on.
struct CodeSteps {
  std::uint64_t first = 0;
  std::uint64_t step = 1;
};
// to[places[code]] = the next sample.
void scatterSamples(std::span<const std::byte> samples, std::size_t width, CodeSteps codes,
                    const std::vector<std::uint32_t>& places, std::span<std::byte> to);
// to[i] = from[places[i]]
void gatherSamples(std::span<const std::byte> from, std::size_t width, const std::vector<std::uint32_t>& places,
                   std::span<std::byte> to);

// Every sample this value, as near as the type comes to it.
void fillSamples(SampleType type, double value, std::span<std::byte> out);

}  // namespace blockwalk
