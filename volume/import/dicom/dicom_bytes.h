// SPDX-License-Identifier: Apache-2.0
// The bytes of a DICOM file, of which the data set may be deflated (PS3.5, annex A.5).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "volume/import/inflate.h"
#include "volume/import/input_file.h"

namespace blockwalk {

// As if what is deflated lay there unpacked. It is unpacked front to back, and again from its beginning where an
// earlier byte is asked for, so that no more than a window of it is held.
class DicomBytes {
 public:
  explicit DicomBytes(const std::filesystem::path& path) : file_(std::make_shared<InputFile>(path)) {}

  const std::string& name() const { return file_->name(); }
  std::uint64_t bytes() const { return bytes_.value_or(file_->bytes()); }
  // All from byte `begin` on is one deflated stream.
  void inflateFrom(std::uint64_t begin);
  // The same, and unpacks it once to know how long it is: without that bytes() is not to be asked. Throws DataError for
  // a stream that is broken, cut off, or longer than a data set may be.
  void measureFrom(std::uint64_t begin);

  // Fills `out` from `offset`, or throws DataError that names the offset.
  void read(std::uint64_t offset, std::span<std::byte> out);
  // Reads what there is of out.size() bytes; returns how many.
  std::size_t readSome(std::uint64_t offset, std::span<std::byte> out);

 private:
  std::shared_ptr<const InputFile> file_;
  std::optional<std::uint64_t> bytes_;
  std::uint64_t begin_ = 0;
  std::unique_ptr<InflateStream> stream_;  // none: nothing is deflated
  std::uint64_t at_ = 0;                   // the next byte of it
};

}  // namespace blockwalk
