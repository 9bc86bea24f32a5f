// SPDX-License-Identifier: Apache-2.0
// What every fuzz target of the importers does with a file: opens it, asks where it is blank, and reads it to the end
// or to a bound.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/fuzz/memory_file.h"
#include "volume/error.h"
#include "volume/import/import.h"

namespace blockwalk {

constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 20;  // read of one source

inline void readSource(const std::string& path, const ImportOptions& options) {
  try {
    const auto source = openSource({path}, options);
    const SourceInfo& info = source->info();
    if (!info.blank.empty()) {
      std::vector<VoxelRun> runs;
      source->findRuns({.begin = glm::ivec3(0), .end = info.dims}, runs);
      source->findRuns({.begin = info.dims / 2, .end = glm::min(info.dims, info.dims / 2 + 8)}, runs);
    }
    const auto row = std::uint64_t{channelRowBytes(info)} * info.channels.size();
    std::vector<std::byte> rows(row);
    std::uint64_t left = kMostBytes / row;
    for (int z = 0; z < info.dims.z && left > 0; ++z) {
      for (int y = 0; y < info.dims.y && left > 0; ++y, --left) source->readRows(z, y, 1, rows);
    }
  } catch (const DataError&) {
    // Refused, as most input is.
  }
}

// The bytes as a file of whatever kind they look like: as it is, and with a channel for each field.
inline void readFile(const std::uint8_t* data, std::size_t size) {
  static const MemoryFile file;
  file.fill(data, size);
  ImportOptions options;
  options.memory_bytes = std::uint64_t{4} << 20;
  readSource(file.path(), options);
  options.channels = ChannelRule::fields;
  readSource(file.path(), options);
}

}  // namespace blockwalk
