// SPDX-License-Identifier: Apache-2.0
// The header of a .bwv file to and from VolumeInfo.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "volume/file/layout.h"

namespace blockwalk {

struct DecodedHeader {
  VolumeInfo info;
  FileLayout layout;  // with the checksums
};

// The header's bytes. `layout` is layOutFile(info) with the sections' checksums filled in.
std::vector<std::byte> encodeHeader(const VolumeInfo& info, const FileLayout& layout);

// Checks every field of the header against its bound, and the sections against the layout that the counts give.
// `start` holds at least the header, or the whole file when that is shorter; `file_bytes` is the file's length.
// Throws DataError naming `file`, the field, its offset and the bound. Allocates nothing that the file's length does
// not bound.
DecodedHeader decodeHeader(std::span<const std::byte> start, std::uint64_t file_bytes, const std::string& file);

// XXH3-64.
std::uint64_t checksumOf(std::span<const std::byte> bytes);

}  // namespace blockwalk
