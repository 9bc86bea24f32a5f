// SPDX-License-Identifier: Apache-2.0
// A zip file of slices, of a DICOM series or of one file, unpacked into a folder of its own for as long as it is read.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "volume/import/input_file.h"
#include "volume/source.h"

namespace blockwalk {

// Whether an entry of the file, or one in its only folder, makes it a Zarr hierarchy.
bool isZarrZip(std::shared_ptr<const InputFile> file, std::uint64_t memory_bytes);

// Unpacks it below the folder for temporary files (TMPDIR), and opens what lies there with `open`: the folder, the only
// folder in it, or the only file. It is removed with the source. Throws DataError for names that lead elsewhere, for
// more than 200,000 files, and where it would leave less than 1 GiB of the disk.
std::unique_ptr<Source> openZipFolder(std::shared_ptr<const InputFile> file, std::uint64_t memory_bytes,
                                      const std::function<std::unique_ptr<Source>(const std::filesystem::path&)>& open);

}  // namespace blockwalk
