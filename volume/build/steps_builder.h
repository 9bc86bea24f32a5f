// SPDX-License-Identifier: Apache-2.0
// Builds a .bwv file of several steps in time: one source after the other, in one file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "volume/build/builder.h"
#include "volume/build/storage.h"

namespace blockwalk {

class StepsBuilder {
 public:
  // 2..kMaxSteps steps. The file gets its name with finish().
  StepsBuilder(const std::filesystem::path& path, int steps);

  // The next step, as buildVolume() would build it alone, but that its values are what those of the first are: amounts
  // or labels. Throws DataError also where it is not on the grid of the first, and where labels were guessed and it has
  // other values.
  const BuildReport& add(Source& source, const BuildOptions& options);
  const std::vector<BuildReport>& steps() const { return reports_; }
  // After the last. `accept` as in BuildOptions. Returns the bytes of the file.
  std::uint64_t finish(const std::function<void(const std::filesystem::path& complete)>& accept = nullptr);
  const std::vector<std::filesystem::path>& leftovers() const { return file_.leftovers(); }

 private:
  void checkStep(const SourceInfo& source) const;

  std::size_t count_;
  OutputFile file_;
  std::uint64_t end_ = 0;
  std::vector<std::uint64_t> begins_;
  std::vector<BuildReport> reports_;
};

}  // namespace blockwalk
