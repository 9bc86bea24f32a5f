// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/kept_sums.h"

#include <algorithm>

namespace blockwalk {

KeptPicture* KeptSums::take(const SampleStep& step, std::uint64_t volume, const ResolvedView& view) {
  const auto found = std::ranges::find(pictures_, step.owner, &KeptPicture::owner);
  if (found != pictures_.end()) {
    const bool goes_on =
        step.begin > 0 && found->samples == step.begin && found->volume == volume && found->view == view;
    if (goes_on) {
      pictures_.splice(pictures_.begin(), pictures_, found);
      return &pictures_.front();
    }
    pictures_.erase(found);
  }
  const std::uint64_t bytes =
      kSumBytes * static_cast<std::uint64_t>(view.width) * static_cast<std::uint64_t>(view.height);
  if (bytes > most_bytes_) return nullptr;
  makeRoom(bytes);
  KeptPicture picture{.owner = step.owner,
                      .volume = volume,
                      .view = view,
                      .samples = 0,
                      .sums = Buffer(device_, bytes, BufferUse::resident)};
  pictures_.push_front(std::move(picture));
  return &pictures_.front();
}

void KeptSums::drop(std::uint64_t owner) {
  std::erase_if(pictures_, [owner](const KeptPicture& picture) { return picture.owner == owner; });
}

void KeptSums::makeRoom(std::uint64_t bytes) {
  std::uint64_t used = 0;
  for (const KeptPicture& picture : pictures_) used += picture.sums.bytes();
  while (used + bytes > most_bytes_) {
    used -= pictures_.back().sums.bytes();
    pictures_.pop_back();
  }
}

}  // namespace blockwalk
