// SPDX-License-Identifier: Apache-2.0
// The order of a stack's slices, by their file names.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "volume/import/sniff.h"

namespace blockwalk {

// Runs of digits compare as numbers: slice2 comes before slice10. A strict order: names that differ only in leading
// zeros compare by their characters.
bool comesBefore(std::string_view a, std::string_view b);

// By their names so, whatever folders they lie in. Throws DataError for one that is there twice.
void orderByName(std::vector<std::filesystem::path>& paths);

// PNG, TIFF, JPEG, JPEG 2000, WebP and GIF.
bool isSliceKind(FileKind kind);
constexpr std::string_view kSliceFormats = "PNG, TIFF, JPEG, JPEG 2000, WebP nor GIF";  // behind "neither"

// The slices of a folder, in natural order. What begins with a dot is passed over, and so is what is of another kind;
// but what is named like a slice and is none, or is no regular file and no link to one, throws DataError, as do a
// folder without slices and one with slices of several kinds.
std::vector<std::filesystem::path> slicesInFolder(const std::filesystem::path& folder);

// Tells of numbers in the files' names that are missing between others, or there twice: what lies behind is not where
// it should be. A regular step is none, nor are names without numbers.
void noteGaps(const std::vector<std::filesystem::path>& slices, std::vector<std::string>& notes);

}  // namespace blockwalk
