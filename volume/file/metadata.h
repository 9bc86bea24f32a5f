// SPDX-License-Identifier: Apache-2.0
// The metadata of a .bwv file: lines of text, each a key, a tab, and a value. docs/format.md lists the keys.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "volume/volume.h"

namespace blockwalk {

constexpr std::size_t kMaxMetadataBytes = std::size_t{1} << 20;

// Only what is known gets a line. Throws DataError where a text is too long or not plain, naming `file` and the key.
std::string encodeMetadata(const VolumeInfo& info, const std::string& file);

// Fills info.metadata and, of each of its channels, name, unit, colour, window and labels. A key that this program does
// not know is kept. Throws DataError that names `file`, the key, its offset in the file and the bound; `offset` is
// where `text` begins.
void decodeMetadata(std::string_view text, std::size_t offset, const std::string& file, VolumeInfo& info);

}  // namespace blockwalk
