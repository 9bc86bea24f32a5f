// SPDX-License-Identifier: Apache-2.0
// Unpacks a gzip or zlib stream inside a file, front to back, in bounded memory.
#pragma once

#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

// Starts at byte `first` of the file. Several gzip members one after another are one stream, as gzip has it; anything
// else behind the end of the stream is a DataError. Not movable: zlib keeps a pointer to its state.
class InflateStream {
 public:
  InflateStream(std::shared_ptr<const InputFile> file, std::uint64_t first);
  ~InflateStream();
  InflateStream(const InflateStream&) = delete;
  InflateStream& operator=(const InflateStream&) = delete;

  const std::string& name() const { return file_->name(); }
  void restart();
  // Fills `out`; returns fewer bytes only at the end of the stream. Throws DataError for a broken or cut stream.
  std::size_t read(std::span<std::byte> out);
  // Passes over up to `bytes`; returns fewer only at the end of the stream.
  std::uint64_t skip(std::uint64_t bytes);

 private:
  bool fill();
  void endMember();

  std::shared_ptr<const InputFile> file_;
  std::uint64_t first_;
  std::uint64_t position_;  // in the file, of the first byte not yet handed to zlib
  std::vector<std::byte> input_;
  z_stream zlib_{};
  bool ended_ = false;
};

}  // namespace blockwalk
