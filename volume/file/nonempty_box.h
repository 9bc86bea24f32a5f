// SPDX-License-Identifier: Apache-2.0
// Where a volume holds something, from the records of blocks alone: what is framed where nobody says what to look at.
//
// The box is that of the stored subblocks of a level. Where the records of level 0 have more than kBoxRecordBytes it is
// a coarser one: of its maxima, in which nothing is lost, and the box is larger by less than a subblock of that level;
// where there are none (labels), of its values, in which what is thin can be lost.
#pragma once

#include <cstdint>

#include "volume/file/header.h"
#include "volume/file/record_reader.h"

namespace blockwalk {

// So few are read in some milliseconds.
constexpr std::uint64_t kBoxRecordBytes = std::uint64_t{4} << 20;
// Of a file of more steps in time so many are looked at, the first, the last, and evenly between.
constexpr int kMostBoxSteps = 64;

// The finest that is looked at where so many bytes of records are read at most; else the coarsest.
EntryPlace boxEntry(const DecodedHeader& header, std::uint64_t most_bytes);

// Of the level's stored subblocks, voxels of level 0 inside the volume; empty where there are none. Throws DataError
// where the records are not what the builder writes.
VoxelBox boxOfRecords(const RecordPlace& place, int level, const VolumeInfo& info, const ReadBytes& read);

}  // namespace blockwalk
