// SPDX-License-Identifier: Apache-2.0
#include "volume/file/section_reader.h"

#include <algorithm>

namespace blockwalk {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

}  // namespace

std::span<const std::byte> SectionReader::ahead(std::size_t most) {
  if (ahead_.size() - begin_ < most && unread_ > 0) fill(most);
  return std::span(ahead_).subspan(begin_, std::min(most, ahead_.size() - begin_));
}

void SectionReader::fill(std::size_t most) {
  const std::size_t kept = ahead_.size() - begin_;
  std::copy(ahead_.begin() + static_cast<std::ptrdiff_t>(begin_), ahead_.end(), ahead_.begin());
  const auto more = static_cast<std::size_t>(std::min<std::uint64_t>(std::max(kPieceBytes, most - kept), unread_));
  ahead_.resize(kept + more);
  begin_ = 0;
  const std::span<std::byte> fresh = std::span(ahead_).subspan(kept);
  read_(next_, fresh);
  checksum_.add(fresh);
  next_ += more;
  unread_ -= more;
}

std::uint64_t SectionReader::checksum() {
  while (unread_ > 0) {
    begin_ = ahead_.size();
    fill(1);
  }
  return checksum_.value();
}

}  // namespace blockwalk
