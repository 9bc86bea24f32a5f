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

// The header's bytes. `layout` is layOutFile(info) with the sections' checksums filled in, `metadata` what
// encodeMetadata(info) gave.
std::vector<std::byte> encodeHeader(const VolumeInfo& info, const FileLayout& layout, const std::string& metadata);

// How many bytes decodeHeader() needs: looks at the signature, the version and the header's length alone. `start` holds
// the FileHeader.
std::size_t headerBytes(std::span<const std::byte> start, std::uint64_t file_bytes, const std::string& file);

// Checks every field of the header against its bound, and the sections against the layout that the counts give.
// `header` holds headerBytes(); `file_bytes` is the file's length. Throws DataError naming `file`, the field, its
// offset and the bound. Allocates nothing that the file's length does not bound.
DecodedHeader decodeHeader(std::span<const std::byte> header, std::uint64_t file_bytes, const std::string& file);

}  // namespace blockwalk
