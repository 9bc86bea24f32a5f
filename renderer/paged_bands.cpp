// SPDX-License-Identifier: Apache-2.0
// Bands of a frame whose voxels come and go: each is drawn, what it lacked is brought in, and it is drawn again until
// it lacks nothing, or as much as there is room for.
#include <algorithm>
#include <utility>

#include "renderer/planned_frame.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

void copySums(Device& device, const Buffer& from, std::uint64_t from_at, const Buffer& to, std::uint64_t to_at,
              std::uint64_t bytes) {
  device.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
    commands.copyBuffer(from.handle(), to.handle(), vk::BufferCopy{from_at, to_at, bytes});
  });
}

}  // namespace

void PlannedFrame::beginPaged(const Band& band) {
  std::ranges::fill(buffers_.wanted.mappedAs<std::uint32_t>(), 0u);
  moment_ = tools_.pages.nextMoment();
  // The band may be drawn again: what it adds to is kept as it was before it was drawn first.
  if (band.sample_begin != sample_begin_ || draws_again_) return;
  counters_before_ = buffers_.counters.mappedAs<gpu::GpuCounters>()[0];
  if (sample_begin_ > 0)
    copySums(tools_.device, kept_->sums, sumBytes(band.row_begin), buffers_.kept_sums, 0, sumBytes(band.row_count));
}

// Nothing of the band counts, and it comes again from its first sample on.
void PlannedFrame::undoBand() {
  const Band band = cutter_->next();
  buffers_.counters.mappedAs<gpu::GpuCounters>()[0] = counters_before_;
  if (sample_begin_ > 0)
    copySums(tools_.device, buffers_.kept_sums, 0, kept_->sums, sumBytes(band.row_begin), sumBytes(band.row_count));
  cutter_->again();
}

// Whether the band is to be drawn again.
bool PlannedFrame::lacksPages() {
  const auto bits = buffers_.wanted.mappedAs<std::uint32_t>();
  bool lacks = false;
  std::uint64_t absent_blocks = 0;
  for (PagedVoxels* const voxels : paged_) {
    const std::size_t words = (voxels->blockCount() + 31) / 32;
    std::vector<std::uint32_t> absent = voxels->note(bits.first(words), moment_);
    absent_blocks += absent.size();
    lacks = lacks || !absent.empty();
    if (!absent.empty()) voxels->want(std::move(absent));
  }
  const bool again = lacks && !order_.as_it_is && !is_short_;
  if (!again) frame_.stats.absent_blocks += absent_blocks;
  // What is short for some samples is so for all of the band.
  const Band& band = cutter_->next();
  if (band.sample_begin + band.sample_count >= sample_end_) is_short_ = false;
  holdPages(again ? std::optional(moment_) : std::nullopt);
  brings_pages_ = draws_again_ = again;
  if (again) undoBand();
  // Who waits for nothing has others find it.
  if (!again && order_.as_it_is) {
    for (PagedVoxels* const voxels : paged_) bringInSome(*voxels, false);
  }
  return again;
}

bool PlannedFrame::bringInSome(PagedVoxels& voxels, bool waits) {
  const std::uint64_t before = voxels.arrived();
  const bool more = voxels.advance(waits);
  frame_.stats.pages_read += voxels.arrived() - before;
  return more;
}

// What was used at that moment or later stays.
void PlannedFrame::holdPages(std::optional<std::uint64_t> moment) {
  if (moment) tools_.pages.hold(*moment);
  if (held_moment_) tools_.pages.letGo(*held_moment_);
  held_moment_ = moment;
}

// A piece of what the band lacked; true while there is more. Where it needs more than there is room for it is cut
// smaller, and where it cannot be, drawn with what is there.
bool PlannedFrame::bringPages() {
  bool more = false;
  for (PagedVoxels* const voxels : paged_) {
    if (!more) more = bringInSome(*voxels, true);
    is_short_ = voxels->wasShort() || is_short_;
  }
  brings_pages_ = more;
  if (more || !is_short_) return more;
  is_short_ = !cutter_->narrow();
  if (!is_short_) holdPages(std::nullopt);
  return false;
}

}  // namespace blockwalk
