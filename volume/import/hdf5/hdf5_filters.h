// SPDX-License-Identifier: Apache-2.0
// Undoes the filters that chunks of HDF5 went through: those of the library, and those of its registry that microscopes
// and detectors write.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "volume/import/hdf5/hdf5_object.h"

namespace blockwalk {

// Throws DataError that names `dataset` and the filter where one of them cannot be undone.
void checkHdf5Filters(std::span<const Hdf5Filter> filters, const std::string& dataset);

// Undoes them, the last first, but for those whose bit of `left_out` is set. Takes memory for a few times `bytes`,
// whatever the packed bytes say. `width`: bytes of a sample. Throws DataError that names `chunk` and the filter unless
// they unpack to exactly `bytes`.
std::vector<std::byte> unpackHdf5(std::vector<std::byte> packed, std::span<const Hdf5Filter> filters,
                                  std::uint64_t left_out, std::uint64_t bytes, std::size_t width,
                                  const std::string& chunk);

// The steps, for each of which nothing is an answer where the bytes are broken.
// bits of samples that lie together, in blocks, of which each may be packed as LZ4 or zstd: filter 32008.
bool undoBitshuffle(std::span<const std::byte> packed, const Hdf5Filter& filter, std::size_t width,
                    std::span<std::byte> out);
// Blocks of LZ4: filter 32004.
bool undoLz4Blocks(std::span<const std::byte> packed, std::span<std::byte> out);
// LibLZF, h5py's own: filter 32000.
bool undoLzf(std::span<const std::byte> packed, std::span<std::byte> out);
// Extended-Rice coding, as libaec has it.
bool undoSzip(std::span<const std::byte> packed, const Hdf5Filter& filter, std::span<std::byte> out);
bool canUndoSzip();

}  // namespace blockwalk
