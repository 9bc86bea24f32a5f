// SPDX-License-Identifier: Apache-2.0
// The data files that NRRD and MetaImage headers name: one, a list of them, or a pattern of numbered ones.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

struct DataFiles {
  std::vector<std::filesystem::path> paths;  // regular files; none: the data follows the header
  std::string note;                          // for people: what lies elsewhere; empty mostly
};

// "LIST", "LIST 2", "LIST 2D": the axes of the array that each file has, 0 where that is not said. Nothing for what is
// no list. Throws DataError for any other word behind it.
std::optional<int> axesOfList(std::string_view text, const std::string& source, const std::string& field);

// `a%03d.raw 1 12 1` and, behind it, the axes that each file has: 0 where that is not said.
struct FilePattern {
  std::string name;
  std::int64_t first = 0;
  std::int64_t last = 0;
  std::int64_t step = 1;
  int axes = 0;
};

// Nothing where `text` is no pattern: %d, %i or %u, maybe with a width, and three or four whole numbers behind.
std::optional<FilePattern> filePattern(std::string_view text);

// The names of a pattern's files. Throws DataError unless there are `count`.
std::vector<std::string> namesOf(const FilePattern& pattern, std::uint64_t count, const std::string& source,
                                 const std::string& field);

// How many files hold the array when each has the first `axes` of its axes, 0: all but the last. Throws DataError.
std::uint64_t fileCount(std::span<const std::int64_t> sizes, int axes, const std::string& source,
                        const std::string& field);

// The files of these names, from the header's folder. They may lie elsewhere, as other programs write absolute names
// and names with `..`: that is told. Throws DataError, naming `field`, for what is not there.
DataFiles findDataFiles(const InputFile& header, const std::string& field, std::span<const std::string> names);

// Whether a regular file has this name, from the header's folder.
bool isDataFile(const InputFile& header, const std::string& name);

}  // namespace blockwalk
