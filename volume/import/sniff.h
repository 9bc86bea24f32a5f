// SPDX-License-Identifier: Apache-2.0
// What a file is, by its first bytes.
#pragma once

#include "volume/import/input_file.h"

namespace blockwalk {

enum class FileKind { unknown, nrrd, metaimage, png, tiff, prism, idx };

FileKind fileKind(const InputFile& file);

}  // namespace blockwalk
