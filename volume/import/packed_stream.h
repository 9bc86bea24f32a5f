// SPDX-License-Identifier: Apache-2.0
// A compressed stream inside a file, unpacked front to back in bounded memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "volume/import/input_file.h"

namespace blockwalk {

enum class Packing { none, gzip, bzip2 };  // gzip: or zlib, told by the first bytes

class PackedStream {
 public:
  virtual ~PackedStream() = default;
  virtual const std::string& name() const = 0;
  virtual void restart() = 0;
  // Fills `out`; returns fewer bytes only at the end of the stream. Throws DataError for a broken or cut stream.
  virtual std::size_t read(std::span<std::byte> out) = 0;
  // Of the file, behind the end of the stream, once that was met.
  virtual std::uint64_t bytesBehind() const = 0;
  // Passes over up to `bytes`; returns fewer only at the end of the stream.
  std::uint64_t skip(std::uint64_t bytes);
};

// A stream that starts at byte `first` of the file.
std::unique_ptr<PackedStream> openPacked(Packing packing, std::shared_ptr<const InputFile> file, std::uint64_t first);

}  // namespace blockwalk
