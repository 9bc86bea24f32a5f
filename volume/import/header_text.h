// SPDX-License-Identifier: Apache-2.0
// Reading the text headers of image files: lines, words and numbers, strictly.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

// A header longer than this is refused.
constexpr std::uint64_t kMaxHeaderTextBytes = std::uint64_t{1} << 20;

// A text for people that is longer is no name of a unit, and left out.
constexpr std::size_t kMaxUnitBytes = 64;

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

std::string_view trimmed(std::string_view text);
std::vector<std::string_view> words(std::string_view text);
std::string lowerCase(std::string_view text);

// The whole text as a number; nothing where it is none.
std::optional<std::int64_t> parseInteger(std::string_view text);
std::optional<double> parseReal(std::string_view text);  // accepts nan and inf

}  // namespace blockwalk
