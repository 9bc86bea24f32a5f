// SPDX-License-Identifier: Apache-2.0
// A volume built into a file that may hold others.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "volume/build/budget.h"
#include "volume/build/storage.h"

namespace blockwalk {

// Where a volume is written.
struct WritePlace {
  OutputFile& file;
  std::uint64_t begin = 0;  // its first byte
};

// Throws DataError for what the source or the options get wrong.
BuildBudget budgetFor(const Source& source, const BuildOptions& options);

// buildVolume() without the file's name: reads the source, and writes where `place` says once all is known, which is
// when it is called. Temporary data lies in the folder of `path`. `options.accept` is not looked at.
BuildReport buildInto(Source& source, const std::filesystem::path& path, const BuildOptions& options,
                      const BuildBudget& budget, const std::function<WritePlace()>& place);

}  // namespace blockwalk
