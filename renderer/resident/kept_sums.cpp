// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/kept_sums.h"

namespace blockwalk {
namespace {

Residency::Which sumsOf(std::uint64_t owner) {
  return [owner](std::uint64_t, const Need& need) { return need.part == Part::sums && need.owner == owner; };
}

}  // namespace

std::unique_ptr<KeptPicture> KeptSums::take(const SampleStep& step, std::uint64_t volume, const ResolvedView& view) {
  std::unique_ptr<KeptPicture> picture{static_cast<KeptPicture*>(residency_.take(sumsOf(step.owner)).release())};
  const bool goes_on = picture != nullptr && step.begin > 0 && picture->samples == step.begin &&
                       picture->volume == volume && picture->view == view;
  if (goes_on) return picture;
  picture.reset();
  const std::uint64_t bytes =
      kSumBytes * static_cast<std::uint64_t>(view.width) * static_cast<std::uint64_t>(view.height);
  if (bytes > most_bytes_) return nullptr;
  residency_.trim(Part::sums, most_bytes_ - bytes);
  picture = std::make_unique<KeptPicture>();
  picture->owner = step.owner;
  picture->volume = volume;
  picture->view = view;
  picture->sums = Buffer(device_, bytes, BufferUse::resident);
  return picture;
}

void KeptSums::keep(std::unique_ptr<KeptPicture> picture) {
  forget(picture->owner);  // two of the owner's frames may have been under way
  residency_.trim(Part::sums, most_bytes_ - std::min(most_bytes_, picture->bytes()));
  const std::uint64_t volume = picture->volume;
  const Need need{.part = Part::sums, .owner = picture->owner};
  residency_.put(volume, need, std::move(picture));
}

void KeptSums::forget(std::uint64_t owner) { residency_.drop(sumsOf(owner)); }

}  // namespace blockwalk
