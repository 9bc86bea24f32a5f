// SPDX-License-Identifier: Apache-2.0
// Samples written as decimal text, as NRRD and MetaImage allow.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "volume/import/convert/sample.h"
#include "volume/import/input_file.h"

namespace blockwalk {

// `count` numbers, maybe with a sign in front, from byte `first` to the end of the file, separated by white space or
// commas, as samples of this machine's byte order. Held in memory: throws DataError when text and samples exceed
// `memory_bytes`, when there are more or fewer numbers, or when one does not fit the type.
std::vector<std::byte> readTextSamples(const InputFile& file, std::uint64_t first, SampleType type, std::uint64_t count,
                                       std::uint64_t memory_bytes);

// `bytes` bytes, two hexadecimal digits each, with white space anywhere; the same otherwise.
std::vector<std::byte> readHexSamples(const InputFile& file, std::uint64_t first, std::uint64_t bytes,
                                      std::uint64_t memory_bytes);

}  // namespace blockwalk
