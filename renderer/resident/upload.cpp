// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/upload.h"

#include <algorithm>

namespace blockwalk {

bool Upload::advance() {
  const std::size_t records =
      std::min<std::size_t>(count_ - done_, std::max<std::uint64_t>(1, kUploadPiece / record_bytes_));
  if (records > 0) {
    // A piece fits the staging buffer, so that it is filled at once.
    uploadBytes(device_, buffer_, done_ * record_bytes_, records * record_bytes_,
                [&](std::uint64_t, std::span<std::byte> piece) { fill_(done_, piece); });
  }
  done_ += records;
  return done_ < count_;
}

}  // namespace blockwalk
