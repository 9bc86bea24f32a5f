// SPDX-License-Identifier: Apache-2.0
// The bytes of one dense array, wherever they are: in a file, in several, in a compressed stream, in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "volume/import/input_file.h"
#include "volume/import/packed_stream.h"

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
  // For people: what lies behind the array and was passed over; empty where nothing does. Of compressed data it is
  // known once all was read.
  virtual std::string remark() const { return {}; }
};

using ByteOpener = std::function<std::unique_ptr<ByteReader>()>;

// What may follow an array where it lies.
enum class Behind {
  nothing,   // more bytes are a DataError
  passed,    // they are passed over and told; but for more than some of unpacked data
  expected,  // they are something else
};

// `bytes` bytes of the file from `first`; throws DataError unless the file holds them.
std::unique_ptr<ByteReader> readFileBytes(std::shared_ptr<const InputFile> file, std::uint64_t first,
                                          std::uint64_t bytes);

std::unique_ptr<ByteReader> readMemoryBytes(std::vector<std::byte> bytes);

// A stream that starts at byte `first` of the file and unpacks to `skip` bytes that are passed over and then `bytes`
// bytes. A stream that is shorter is a DataError with both numbers, thrown by the read that reaches its end; no more
// than `bytes` are ever unpacked for the array.
std::unique_ptr<ByteReader> readPackedBytes(Packing packing, std::shared_ptr<const InputFile> file, std::uint64_t first,
                                            std::uint64_t skip, std::uint64_t bytes, Behind behind);

// `bytes` bytes of `whole` from `first` on. Where that has no random access they are unpacked up to there.
std::unique_ptr<ByteReader> readPart(std::unique_ptr<ByteReader> whole, std::uint64_t first, std::uint64_t bytes);

// Length of the stream once unpacked; unpacks it without keeping it. Throws DataError when it exceeds `limit`.
std::uint64_t unpackedBytes(Packing packing, const InputFile& file, std::uint64_t first, std::uint64_t limit);

// How an array lies in a file, as text headers say it.
struct DataLayout {
  std::string field;  // that says how large it is: named in messages
  Packing packing = Packing::none;
  std::uint64_t begin = 0;      // behind the header where that is in the same file
  std::uint64_t line_skip = 0;  // lines of the file as it lies on disk, before any unpacking
  std::int64_t byte_skip = 0;   // then, of what is unpacked; -1: the array is the last of the bytes
};

// Behind begin and line_skip.
std::uint64_t firstByte(const InputFile& file, const DataLayout& layout);

// What follows the array is told. Throws DataError where the file is too short.
std::unique_ptr<ByteReader> readLaidOut(std::shared_ptr<const InputFile> file, const DataLayout& layout,
                                        std::uint64_t bytes);

// An array of which each of the files has an equal part that lies as `layout` says. Files are open while they are read.
std::unique_ptr<ByteReader> readLaidOutParts(std::vector<std::filesystem::path> files, const DataLayout& layout,
                                             std::uint64_t part_bytes);

}  // namespace blockwalk
