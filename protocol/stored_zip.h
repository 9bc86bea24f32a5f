// SPDX-License-Identifier: Apache-2.0
// A zip file of entries that are stored as they are (APPNOTE.TXT 6.3.10), written from its beginning to its end:
// an entry's bytes are there before it is begun, so that nothing before them has to be changed later. Pictures do not
// deflate.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace blockwalk {

// Holds the directory alone. All times are the first that zip knows, 1 January 1980.
class StoredZip {
 public:
  // What stands before the entry's bytes, which follow at once, and the next entry or the end after them. At most 65535
  // entries, and 2^32 - 1 bytes of the file (BLOCKWALK_CHECK). Names are ASCII.
  std::string begin(std::string_view name, std::span<const std::byte> bytes);
  // The directory, which ends the file.
  std::string end() const;

 private:
  std::uint64_t offset_ = 0;
  std::uint64_t entries_ = 0;
  std::string directory_;
};

}  // namespace blockwalk
