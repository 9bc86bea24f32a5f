// SPDX-License-Identifier: Apache-2.0
// Bands of a frame whose voxels come and go: what a few of their rays come to is brought in before they are drawn. Each
// is drawn, what it lacked is brought in, and it is drawn again until it lacks nothing, or as much as there is room
// for.
#include <algorithm>
#include <bit>
#include <functional>
#include <utility>

#include "renderer/planned_frame.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

constexpr int kLookStride = 4;
constexpr int kLookStrideAhead = 2;  // of what may come, in pictures that are small as they move
constexpr int kFewestRows = 64;      // to look ahead at
constexpr int kMostLooks = 4;
constexpr int kMostTriesAlone = 4;

// For what is being read: so long nobody else has the device.
constexpr std::chrono::milliseconds kNoPatience{0};
constexpr std::chrono::milliseconds kPatience{5};
constexpr std::chrono::milliseconds kPatienceAhead{1};
// What pixels have shown that long ago may still be looked at.
constexpr std::chrono::milliseconds kOfLate{1000};

constexpr double kUnknownRays = 16384;  // where nothing is known of their time

}  // namespace

// Where the kernel writes the pixels of a part of the band.
void PlannedFrame::aim(const Band& part) {
  const auto skipped =
      static_cast<std::uint64_t>(part.row_begin - cutter_->next().row_begin) * static_cast<std::uint64_t>(frame_.width);
  gpu::FrameParams& params = buffers_.params.mappedAs<gpu::FrameData>()[0].params;
  const auto shifted = [&](std::uint64_t address, std::uint64_t bytes) {
    return address == 0 ? 0 : address + skipped * bytes;
  };
  params.pixels = shifted(bound_.data.params.pixels, sizeof(std::uint32_t));
  params.next_samples = shifted(bound_.data.params.next_samples, sizeof(std::uint32_t));
  params.probes = shifted(bound_.data.params.probes, sizeof(gpu::GpuProbe));
  params.sums =
      kept_ != nullptr ? kept_->sums.address() + sumBytes(part.row_begin) : shifted(bound_.data.params.sums, kSumBytes);
}

// Draws and takes down what rays come to.
double PlannedFrame::runMarking(const Band& part, std::uint32_t fresh_sample, bool accepts) {
  gpu::FrameParams& params = buffers_.params.mappedAs<gpu::FrameData>()[0].params;
  params.fresh_sample = fresh_sample;
  params.accepts = accepts ? 1 : 0;
  moment_ = tools_.pages.nextMoment();
  // Who waits for nothing asks for all of the frame when it has ended.
  const bool gathers = order_.as_it_is && begun_moment_ != 0;
  if (!gathers) std::ranges::fill(buffers_.wanted.mappedAs<std::uint32_t>(), 0u);
  if (begun_moment_ == 0) begun_moment_ = moment_;
  const vk::DescriptorSet set = bound_.instances.empty() ? nullptr : tools_.kernels.bindInstances(bound_.instances);
  const double ms = tools_.bands.run(kernel_, plan_, part, buffers_.params.address(), set);
  frame_.stats.gpu_ms += ms;
  return ms;
}

// A band, or those pixels of a part of it that lacked something: these are drawn again until they lack nothing that can
// come, and then with what there is.
void PlannedFrame::drawPaged() {
  const Band band = cutter_->next();
  const bool is_first = !part_;
  if (is_first) part_.emplace(band);
  const bool accepts = order_.as_it_is || is_short_;
  aim(part_->at());
  const double ms =
      runMarking(part_->at(), is_first ? static_cast<std::uint32_t>(band.sample_begin) : gpu::kNone, accepts);
  WantedBlocks blocks;
  const bool can_come = noteWanted(blocks);
  if (is_first) drawn_ms_ = ms;
  if (order_.as_it_is) {
    part_.reset();
    frame_.stats.wanted_blocks = blocks.wanted;
    frame_.stats.absent_blocks = std::max(frame_.stats.absent_blocks, blocks.absent);
    if (blocks.absent > 0) noteFailure();
    if (cutter_->ran(drawn_ms_)) readBand(band);
    if (cutter_->isDone()) bringForNext();
    return;
  }
  if (is_first) frame_.stats.wanted_blocks += blocks.wanted;
  if (blocks.absent > 0 && !accepts) {
    // Who waits for a turn comes before who has none yet.
    const bool goes_on = held_moment_.has_value() || !tools_.pages.isAwaited() || tools_.pages.hasTurn(asker_);
    if (!goes_on) return awaitTurn();
    brings_pages_ = can_come;
    is_short_ = !can_come;
    if (can_come) holdPages(moment_);
    return;
  }
  frame_.stats.absent_blocks += blocks.absent;
  if (blocks.absent > 0) noteFailure();
  holdPages(std::nullopt);
  is_short_ = false;
  tries_alone_ = 0;
  if (part_->next()) return;
  // The next band tries as much as this found room for, and as much again.
  cutter_->keepWithin(std::min(2 * part_->rows(), kMaxImageSide), std::min(2 * part_->columns(), kMaxImageSide));
  part_.reset();
  if (cutter_->ran(drawn_ms_)) readBand(band);
}

// It holds nothing until then, and then looks again at what it lacks.
void PlannedFrame::awaitTurn() {
  holdPages(std::nullopt);
  tools_.pages.awaitTurn(asker_);
  awaits_turn_ = true;
}

void PlannedFrame::noteFailure() {
  for (const PagedPart& part : bound_.paged) {
    if (!part.voxels->failure().empty()) frame_.stats.page_failure = part.voxels->failure();
  }
}

// What a frame lacked that waited for nothing, a piece of it. Nothing gives way for it that the frame has shown: where
// there is no room for all, some stays coarser, and which does not change from frame to frame.
void PlannedFrame::bringForNext() {
  holdPages(begun_moment_);
  bringInWhatIsRead();
  holdPages(std::nullopt);
}

// And has more of it read.
void PlannedFrame::bringInWhatIsRead() {
  for (const PagedPart& part : bound_.paged) bringInSome(*part.voxels, kNoPatience);
}

std::span<const std::uint32_t> PlannedFrame::wantedBits(const PagedPart& part) const { return wantedBits(part, 0); }

std::span<const std::uint32_t> PlannedFrame::wantedBits(const PagedPart& part, std::uint32_t rank) const {
  const std::uint32_t begin = part.first_word + rank * bound_.data.params.rank_words;
  return buffers_.wanted.mappedAs<std::uint32_t>().subspan(begin, wordsOfBits(part.voxels->blockCount()));
}

std::vector<std::uint32_t> PlannedFrame::anyRank(const PagedPart& part) const {
  std::vector<std::uint32_t> any(wordsOfBits(part.voxels->blockCount()));
  for (std::uint32_t rank = 0; rank < gpu::kRequestRanks; ++rank) {
    std::ranges::transform(any, wantedBits(part, rank), any.begin(), std::bit_or<>());
  }
  return any;
}

// The least that a ray has given each.
void PlannedFrame::sortByRank(const PagedPart& part, std::vector<std::uint32_t>& blocks) const {
  std::ranges::stable_sort(blocks, {}, [&](std::uint32_t block) {
    std::uint32_t rank = 0;
    while ((wantedBits(part, rank)[block / 32] >> block % 32 & 1) == 0) ++rank;
    return rank;
  });
}

// What may give way for what it lacks.
PagePool::Sweep PlannedFrame::sweep() const {
  if (order_.ahead) return {.spares = spared_moment_, .is_ahead = true};
  if (order_.as_it_is) return {.asker = asker_, .spares = begun_moment_};
  return {.asker = asker_, .begun = begun_moment_, .ahead = ahead_moment_ != 0 ? ahead_moment_ : moment_};
}

// Says of every block that a ray came to that it was used now. What is absent is wanted; false where nothing is that
// can come.
bool PlannedFrame::noteWanted(WantedBlocks& blocks) {
  bool lacks = false;
  const PagePool::Asker looker = order_.ahead ? PagePool::kNobody : asker_;
  const std::uint64_t foreseen = tools_.pages.foreseen();
  for (const PagedPart& part : bound_.paged) {
    const std::vector<std::uint32_t> any = hasRanks() ? anyRank(part) : std::vector<std::uint32_t>();
    const std::span<const std::uint32_t> words = hasRanks() ? std::span(any) : wantedBits(part);
    for (const std::uint32_t word : words) blocks.wanted += static_cast<std::uint64_t>(std::popcount(word));
    std::vector<std::uint32_t> absent = part.voxels->note(words, moment_, looker);
    blocks.absent += absent.size();
    if (hasRanks()) sortByRank(part, absent);
    lacks = part.voxels->want(asker_, std::move(absent), sweep()) || lacks;
  }
  frame_.stats.foreseen_pages += tools_.pages.foreseen() - foreseen;
  return lacks;
}

// Before a band is drawn that lies farther down than it was looked.
bool PlannedFrame::looksAhead() const {
  return !bound_.paged.empty() && !order_.as_it_is && !order_.pixel && !part_ && sample_begin_ == 0 &&
         cutter_->next().row_begin >= rows_ahead_;
}

int PlannedFrame::lookStride() const { return order_.ahead ? kLookStrideAhead : kLookStride; }

// So many rows that every fourth ray each way takes about a band's time.
int PlannedFrame::rowsInABand() const {
  const double ms_per_ray =
      tools_.times.find(volume_.serial(), plan_.level, plan_.key).value_or(tools_.band_ms / kUnknownRays);
  const double rows = tools_.band_ms / ms_per_ray * lookStride() * lookStride() / frame_.width;
  return wholeGroups(static_cast<int>(std::clamp(rows, 1.0, static_cast<double>(kMaxImageSide))));
}

// Every fourth ray each way, of as many rows as there is room for: what these come to is brought in together, in the
// order of the file, and again while more comes into sight behind it. So most bands find what they need.
void PlannedFrame::lookAhead() {
  const int begin = order_.ahead ? rows_ahead_ : cutter_->next().row_begin;
  const int rows = std::min({most_rows_ahead_, rowsInABand(), frame_.height - begin});
  const int stride = lookStride();
  const auto part = [&](int side) { return (side + stride - 1) / stride; };
  const int first = begin / stride;
  const Band band{.row_begin = first,
                  .row_count = std::min(part(begin + rows) - first, part(frame_.height) - first),
                  .column_count = part(frame_.width)};
  if (static_cast<std::size_t>(band.row_count) * static_cast<std::size_t>(band.column_count) > kMaxBandPixels) {
    most_rows_ahead_ = wholeGroups(rows / 2);
    return;
  }
  gpu::FrameParams& params = buffers_.params.mappedAs<gpu::FrameData>()[0].params;
  gpu::GpuCounters& counters = buffers_.counters.mappedAs<gpu::GpuCounters>()[0];
  const gpu::GpuCounters before = counters;
  params.size = {band.column_count, part(frame_.height)};
  aim(cutter_->next());  // nothing is in its sums yet
  runMarking(band, 0, true);
  ahead_moment_ = moment_;
  params.size = bound_.data.params.size;
  counters = before;

  const bool fits = usedBytes() <= tools_.pages.mostBytes();
  if (!fits && rows > kFewestRows) {
    most_rows_ahead_ = wholeGroups(rows / 2);
    return;
  }
  WantedBlocks blocks;
  brings_pages_ = noteWanted(blocks) && fits && ++looks_ <= kMostLooks;
  if (brings_pages_) return;
  rows_ahead_ = begin + rows;
  looks_ = 0;
  if (!order_.ahead) cutter_->endAt(rows_ahead_);
}

// Of an order to bring in what may come, a piece. True while there is more that finds room.
bool PlannedFrame::bringAhead() {
  if (bound_.paged.empty()) return false;
  if (!brings_pages_) {
    if (hasLookedAhead()) return false;
    if (spared_moment_ == 0) spared_moment_ = tools_.pages.momentSince(kOfLate);
    lookAhead();
    return brings_pages_ || !hasLookedAhead();
  }
  brings_pages_ = false;
  for (const PagedPart& part : bound_.paged) {
    if (!brings_pages_) brings_pages_ = bringInSome(*part.voxels, kPatienceAhead);
    if (part.voxels->wasShort(asker_)) return false;
  }
  return true;
}

// Of all blocks that a ray came to.
std::uint64_t PlannedFrame::usedBytes() const {
  std::uint64_t bytes = 0;
  for (const PagedPart& part : bound_.paged) {
    forEachBit(wantedBits(part), [&](std::uint32_t block) { bytes += part.voxels->blockBytes(block); });
  }
  return bytes;
}

bool PlannedFrame::bringInSome(PagedVoxels& voxels, std::chrono::milliseconds patience) {
  const std::uint64_t before = voxels.arrived();
  const bool more = voxels.advance(asker_, patience);
  frame_.stats.pages_read += voxels.arrived() - before;
  return more;
}

// What was used at that moment or later stays.
void PlannedFrame::holdPages(std::optional<std::uint64_t> moment) {
  if (moment) tools_.pages.hold(*moment);
  if (!moment) tools_.pages.endTurn(asker_);
  if (held_moment_) tools_.pages.letGo(*held_moment_);
  held_moment_ = moment;
}

// A piece of what the band lacked; true while there is more. Where it needs more than there is room for it is cut
// smaller, and where it cannot be, drawn with what is there.
bool PlannedFrame::bringPages() {
  bool more = false;
  for (const PagedPart& part : bound_.paged) {
    if (!more) more = bringInSome(*part.voxels, kPatience);
    is_short_ = part.voxels->wasShort(asker_) || is_short_;
  }
  brings_pages_ = more;
  if (more || !is_short_) return more;
  if (looks_ > 0) {
    looks_ = kMostLooks;
    is_short_ = false;
    return false;
  }
  is_short_ = !part_->narrow();
  // What others hold they let go, and what they have merely come to since may give way once it is older than what this
  // part comes to when it looks again.
  if (is_short_ && !tools_.pages.isHeldByOne()) {
    is_short_ = false;
    awaitTurn();
    return true;
  }
  if (is_short_ && ++tries_alone_ <= kMostTriesAlone) {
    is_short_ = false;
    return false;
  }
  if (!is_short_) holdPages(std::nullopt);
  return false;
}

}  // namespace blockwalk
