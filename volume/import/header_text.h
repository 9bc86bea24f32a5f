// SPDX-License-Identifier: Apache-2.0
// Reading the text headers of image files line by line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "volume/formats/text.h"
#include "volume/import/input_file.h"

namespace blockwalk {

// A header longer than this is refused.
constexpr std::uint64_t kMaxHeaderTextBytes = std::uint64_t{1} << 20;

// Lines of a header, one after another, without their ends (LF or CRLF).
class HeaderLines {
 public:
  explicit HeaderLines(const InputFile& file);
  // nothing at the end of the file; throws DataError at kMaxHeaderTextBytes
  std::optional<std::string_view> next();
  // file offset of what follows the last line
  std::uint64_t position() const { return position_; }

 private:
  std::string name_;
  std::string text_;
  std::uint64_t file_bytes_;
  std::size_t position_ = 0;
};

}  // namespace blockwalk
