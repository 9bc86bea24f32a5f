// SPDX-License-Identifier: Apache-2.0
// NanoVDB files and grids, ABI 32.
#include <memory>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/openers.h"
#include "volume/import/vdb/grid_choice.h"
#include "volume/import/vdb/nano_file.h"
#include "volume/import/vdb/nano_tree.h"

namespace blockwalk {

std::unique_ptr<Source> openNanoVdb(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const std::vector<NanoEntry> entries = nanoEntries(*file);
  std::vector<GridInfo> grids;
  for (const NanoEntry& entry : entries) {
    NanoBytes bytes(file, entry, options.memory_bytes / 2);
    grids.push_back(nanoGridInfo(bytes, entry.name));
  }
  const auto load = [&](const std::vector<std::size_t>& chosen) {
    std::vector<std::shared_ptr<const SparseGrid>> loaded;
    for (const std::size_t i : chosen) {
      NanoBytes bytes(file, entries[i], options.memory_bytes / 2);
      loaded.push_back(readNanoTree(bytes, grids[i], options.memory_bytes / chosen.size(), file->name()));
    }
    return loaded;
  };
  return openGrids(grids, load, {.name = file->name(), .format = "nanovdb"}, options);
}

}  // namespace blockwalk
