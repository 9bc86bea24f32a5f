// SPDX-License-Identifier: Apache-2.0
// The grids of a NanoVDB file and their bytes, unpacked where a segment packs them. Offsets of the file are trusted
// nowhere: what lies outside of a grid is an error that names it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "volume/formats/nano_layout.h"
#include "volume/import/input_file.h"

namespace blockwalk {

// One grid of a file: where its bytes lie there.
struct NanoEntry {
  std::string name;  // plain, whatever the file has
  nano::Codec codec = nano::Codec::none;
  std::uint64_t offset = 0;
  std::uint64_t file_bytes = 0;
  std::uint64_t grid_bytes = 0;
};

// Throws DataError, naming the file, the field and the bound.
std::vector<NanoEntry> nanoEntries(const InputFile& file);

// The bytes of one grid; of those that are packed all in memory.
class NanoBytes {
 public:
  // Throws DataError for a packed grid of more than `most_bytes`.
  NanoBytes(std::shared_ptr<const InputFile> file, const NanoEntry& entry, std::uint64_t most_bytes);

  std::uint64_t size() const { return size_; }
  // Valid until the next call. Throws DataError where they lie outside of the grid.
  std::span<const std::byte> get(std::uint64_t offset, std::size_t bytes);
  // Throws DataError, naming the file and the grid.
  [[noreturn]] void fail(const std::string& detail) const;

 private:
  void unpack(const NanoEntry& entry);

  std::shared_ptr<const InputFile> file_;
  std::string name_;
  std::uint64_t size_ = 0;
  std::uint64_t first_ = 0;  // in the file
  bool is_packed_ = false;
  std::uint64_t window_begin_ = 0;
  std::vector<std::byte> window_;  // all of it where it was packed
};

}  // namespace blockwalk
