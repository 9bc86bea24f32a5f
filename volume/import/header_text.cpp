// SPDX-License-Identifier: Apache-2.0
#include "volume/import/header_text.h"

#include <algorithm>

#include "volume/error.h"

namespace blockwalk {

HeaderLines::HeaderLines(const InputFile& file) : name_(file.name()), file_bytes_(file.bytes()) {
  text_.resize(std::min(file.bytes(), kMaxHeaderTextBytes));
  text_.resize(file.readSome(0, std::as_writable_bytes(std::span(text_))));
}

std::optional<std::string_view> HeaderLines::next() {
  if (position_ >= text_.size()) {
    if (text_.size() < file_bytes_) failData("{}: the header is longer than {} bytes", name_, kMaxHeaderTextBytes);
    return std::nullopt;
  }
  const std::size_t end = std::min(text_.find('\n', position_), text_.size());
  std::string_view line = std::string_view(text_).substr(position_, end - position_);
  if (line.ends_with('\r')) line.remove_suffix(1);
  position_ = std::min(end + 1, text_.size());
  return line;
}

}  // namespace blockwalk
