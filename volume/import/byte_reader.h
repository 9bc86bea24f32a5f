// SPDX-License-Identifier: Apache-2.0
// The bytes of one dense array, wherever they are: in a file, in a compressed stream, in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

class ByteReader {
 public:
  virtual ~ByteReader() = default;
  // Then several threads may read at a time.
  virtual bool randomAccess() const = 0;
  // Fills `out` from byte `offset` of the array. Without random access calls are ascending without gaps, but for offset
  // 0, which starts again. Throws DataError.
  virtual void read(std::uint64_t offset, std::span<std::byte> out) = 0;
  // Whether some bytes are known to be 0 without a look at them; only with random access.
  virtual bool hasHoles() const { return false; }
  // Of those that have: the first from `offset` on that are not, beyond the end of the array where there are none. From
  // several threads at a time.
  virtual ByteRange dataFrom(std::uint64_t offset) const { return {offset, UINT64_MAX}; }
};

// `bytes` bytes of the file from `first`; throws DataError unless the file holds them.
std::unique_ptr<ByteReader> readFileBytes(std::shared_ptr<const InputFile> file, std::uint64_t first,
                                          std::uint64_t bytes);

std::unique_ptr<ByteReader> readMemoryBytes(std::vector<std::byte> bytes);

// A gzip or zlib stream that starts at byte `first` of the file and unpacks to `skip` bytes that are passed over and
// then exactly `bytes` bytes. A stream that is shorter or longer is a DataError with both numbers, thrown by the read
// that reaches its end; no more than `bytes` are ever unpacked for the array.
std::unique_ptr<ByteReader> readCompressedBytes(std::shared_ptr<const InputFile> file, std::uint64_t first,
                                                std::uint64_t skip, std::uint64_t bytes);

// Length of the stream once unpacked; unpacks it without keeping it. Throws DataError when it exceeds `limit`.
std::uint64_t unpackedBytes(const InputFile& file, std::uint64_t first, std::uint64_t limit);

}  // namespace blockwalk
