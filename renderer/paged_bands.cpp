// SPDX-License-Identifier: Apache-2.0
// Bands of a frame whose voxels come and go: what a few of their rays come to is brought in before they are drawn. Each
// is drawn, what it lacked is brought in, and it is drawn again until it lacks nothing, or as much as there is room
// for.
#include <algorithm>
#include <bit>
#include <utility>

#include "renderer/planned_frame.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

constexpr int kLookStride = 4;
constexpr int kFewestRows = 64;  // to look ahead at
constexpr int kMostLooks = 4;

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

// Says of every block that a ray came to that it was used now. What is absent is wanted; false where nothing is that
// can come.
bool PlannedFrame::noteWanted(WantedBlocks& blocks) {
  const auto bits = buffers_.wanted.mappedAs<std::uint32_t>();
  bool lacks = false;
  for (PagedVoxels* const voxels : paged_) {
    const auto words = bits.first((voxels->blockCount() + 31) / 32);
    for (const std::uint32_t word : words) blocks.wanted += static_cast<std::uint64_t>(std::popcount(word));
    std::vector<std::uint32_t> absent = voxels->note(words, moment_);
    blocks.absent += absent.size();
    lacks = voxels->want(std::move(absent)) || lacks;
  }
  return lacks;
}

// Whether the band is to be drawn again.
bool PlannedFrame::lacksPages() {
  WantedBlocks blocks;
  const bool lacks = noteWanted(blocks);
  const bool again = lacks && !order_.as_it_is && !is_short_;
  if (!again) {
    frame_.stats.wanted_blocks += blocks.wanted;
    frame_.stats.absent_blocks += blocks.absent;
  }
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

// Before a band is drawn that lies farther down than it was looked.
bool PlannedFrame::looksAhead() const {
  return !paged_.empty() && !order_.as_it_is && !draws_again_ && sample_begin_ == 0 &&
         cutter_->next().row_begin >= rows_ahead_;
}

// Every fourth ray each way, of as many rows as there is room for: what these come to is brought in together, in the
// order of the file, and again while more comes into sight behind it. So most bands find what they need.
void PlannedFrame::lookAhead() {
  const int begin = cutter_->next().row_begin;
  const int rows = std::min(most_rows_ahead_, frame_.height - begin);
  const auto part = [](int side) { return (side + kLookStride - 1) / kLookStride; };
  const int first = begin / kLookStride;
  const Band band{.row_begin = first,
                  .row_count = std::min(part(begin + rows) - first, part(frame_.height) - first),
                  .column_count = part(frame_.width)};
  if (static_cast<std::size_t>(band.row_count) * static_cast<std::size_t>(band.column_count) > kMaxBandPixels) {
    most_rows_ahead_ = rows / 2;
    return;
  }
  gpu::FrameParams& params = buffers_.params.mappedAs<gpu::FrameParams>()[0];
  gpu::GpuCounters& counters = buffers_.counters.mappedAs<gpu::GpuCounters>()[0];
  const gpu::GpuCounters before = counters;
  params.size = {band.column_count, part(frame_.height)};
  if (kept_ != nullptr) params.sums = kept_->sums.address();  // nothing is in them yet
  std::ranges::fill(buffers_.wanted.mappedAs<std::uint32_t>(), 0u);
  moment_ = tools_.pages.nextMoment();
  const vk::DescriptorSet set = bound_.instances ? tools_.kernels.bindInstances(bound_.instances) : nullptr;
  frame_.stats.gpu_ms += tools_.bands.run(kernel_, plan_, band, buffers_.params.address(), set);
  params.size = bound_.params.size;
  counters = before;

  const bool fits = usedBytes() <= tools_.pages.mostBytes();
  if (!fits && rows > kFewestRows) {
    most_rows_ahead_ = rows / 2;
    return;
  }
  WantedBlocks blocks;
  brings_pages_ = noteWanted(blocks) && fits && ++looks_ <= kMostLooks;
  if (brings_pages_) return;
  rows_ahead_ = begin + rows;
  looks_ = 0;
}

// Of all blocks that a ray came to.
std::uint64_t PlannedFrame::usedBytes() const {
  std::uint64_t bytes = 0;
  for (const PagedVoxels* const voxels : paged_) {
    forEachBit(buffers_.wanted.mappedAs<std::uint32_t>().first((voxels->blockCount() + 31) / 32),
               [&](std::uint32_t block) { bytes += voxels->blockBytes(block); });
  }
  return bytes;
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
  if (looks_ > 0) {
    looks_ = kMostLooks;
    is_short_ = false;
    return false;
  }
  is_short_ = !cutter_->narrow();
  if (!is_short_) holdPages(std::nullopt);
  return false;
}

}  // namespace blockwalk
