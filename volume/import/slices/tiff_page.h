// SPDX-License-Identifier: Apache-2.0
// Interpreting one TIFF directory.
#pragma once

#include <tiffio.h>

#include <string>

#include "volume/import/slices/tiff_file.h"

namespace blockwalk {

// The page of the current directory; throws DataError that names the file, the page and the tag for what cannot be
// read.
TiffPage readTiffPage(TIFF* tiff, const std::string& file_name, int number);

// ImageDescription of the current directory; empty where there is none. Throws DataError for one beyond
// kMaxDescriptionBytes.
constexpr std::size_t kMaxDescriptionBytes = std::size_t{16} << 20;
std::string tiffDescription(TIFF* tiff, const std::string& file_name);

// A reduced copy of another page, or a transparency mask.
bool isSecondaryPage(TIFF* tiff);
// The first of these.
bool isReducedPage(TIFF* tiff);

}  // namespace blockwalk
