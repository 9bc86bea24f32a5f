// SPDX-License-Identifier: Apache-2.0
// A run of a file's bytes read from its first to its last, a piece at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "volume/file/checksum.h"

namespace blockwalk {

// Fills `out` from `offset` on, or throws DataError.
using ReadBytes = std::function<void(std::uint64_t offset, std::span<std::byte> out)>;

class SectionReader {
 public:
  // `read` outlives it.
  SectionReader(const ReadBytes& read, std::uint64_t offset, std::uint64_t bytes)
      : read_(read), next_(offset), unread_(bytes) {}

  // The next bytes, so many or as many as are left. Good until the next call.
  std::span<const std::byte> ahead(std::size_t most);
  // Goes on behind so many of those.
  void skip(std::size_t bytes) { begin_ += bytes; }
  // Of the next byte.
  std::uint64_t offset() const { return next_ - ahead_.size() + begin_; }
  std::uint64_t left() const { return unread_ + ahead_.size() - begin_; }
  // Of all of the run, what was not looked at too.
  std::uint64_t checksum();

 private:
  void fill(std::size_t most);

  const ReadBytes& read_;
  std::uint64_t next_;
  std::uint64_t unread_;
  std::vector<std::byte> ahead_;
  std::size_t begin_ = 0;
  RunningChecksum checksum_;
};

}  // namespace blockwalk
