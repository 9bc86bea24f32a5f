// SPDX-License-Identifier: Apache-2.0
// The voxels of one array of Zarr version 3, sharded: chunks packed with zstd, many of them a file, those that have
// nothing but the fill value not there (zarr-specs.readthedocs.io, codec "sharding_indexed" 1.0).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>

#include "volume/export/export_job.h"

namespace blockwalk {

// What the array is: its zarr.json. Axes are z, y, x, behind one of channels where there are several, or a colour.
nlohmann::json zarrArray(const ExportJob& job);

// Writes the files of the array's chunks below `folder`. `done` is told of every shard. Returns the bytes.
std::uint64_t writeZarrChunks(const ExportJob& job, const std::filesystem::path& folder,
                              const std::function<void()>& done);

// Shards of which any may be written: what `done` is called for.
std::uint64_t zarrShards(const ExportJob& job);

}  // namespace blockwalk
