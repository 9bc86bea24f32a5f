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

// A reduced copy of another page, or a transparency mask.
bool isSecondaryPage(TIFF* tiff);

}  // namespace blockwalk
