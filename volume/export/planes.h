// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "volume/build/storage.h"
#include "volume/export/export_job.h"

namespace blockwalk {

// Bytes of the job's voxels, dense.
std::uint64_t planesBytes(const ExportJob& job);

// Writes them from byte `begin` of the file on, channel after channel, x fastest, little endian; the file ends there.
void writePlanes(const ExportJob& job, OutputFile& file, std::uint64_t begin);

}  // namespace blockwalk
