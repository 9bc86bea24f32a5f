// SPDX-License-Identifier: Apache-2.0
// One plan on its way to a frame: first every part that it needs is made resident, or found to be, and stays so; then
// the kernel runs band by band and sample by sample, so that no dispatch is long. Of a refinement it draws the samples
// that are new and adds them to the sums that were kept.
#pragma once

#include <chrono>
#include <exception>
#include <optional>
#include <span>
#include <vector>

#include "renderer/band_cutter.h"
#include "renderer/band_part.h"
#include "renderer/bind.h"
#include "renderer/frame_buffers.h"
#include "renderer/level_room.h"
#include "renderer/plan/output_values.h"
#include "renderer/resident/kept_sums.h"
#include "renderer/resident/pages.h"
#include "renderer/vulkan_volume.h"

namespace blockwalk {

// Frames that hold parts or memory. Where there is no room for one more it lets go of all that it holds and waits until
// one has ended, so that no two wait for each other; the last one alone that finds no room is refused.
struct FramesUnderWay {
  std::size_t holding = 0;
  std::uint64_t ended = 0;
};

// What all frames of a renderer share.
struct FrameTools {
  Device& device;
  double band_ms;
  Kernels kernels;
  BandRunner bands;
  PagePool& pages;
  Residency residency;
  KeptSums kept_sums;
  FrameBufferPool buffers;
  BandTimes times;
  FramesUnderWay under_way{};
};

class PlannedFrame {
 public:
  // All outlive it. `order.view` is what is drawn.
  PlannedFrame(FrameTools& tools, const VulkanStep& volume, Plan plan, const FrameOrder& order);
  ~PlannedFrame();
  PlannedFrame(const PlannedFrame&) = delete;
  PlannedFrame& operator=(const PlannedFrame&) = delete;

  // A part, a piece of one, or a dispatch. True while there is more.
  bool advance();
  // As FrameInProgress::waits().
  bool waits() const;
  const Plan& plan() const { return plan_; }
  // Why the plan's level is coarser than the view's.
  void tellShortage(LevelShortage shortage) { shortage_bytes_ = shortage; }
  // advance() has refused it for a part that found no room, though no other frame held any.
  bool foundNoRoom() const { return found_no_room_; }
  // Once there is no more.
  Frame take() { return std::move(frame_); }

 private:
  // Some part that it needs is not resident.
  bool isMaking() const { return next_need_ < plan_.needs.size(); }
  bool isCancelled() const { return order_.cancel != nullptr && order_.cancel->load(std::memory_order_relaxed); }
  bool advanceWork();
  void hold();
  void letGo() noexcept;
  void end() noexcept;
  OutOfDeviceMemory advise(const OutOfDeviceMemory& error) const;
  void defer(std::exception_ptr shortage);
  void describe();
  bool isResident();
  bool makeResident();
  void begin();
  void takeSums();
  void drawOne();
  void readBand(const Band& band);
  void readPixel();
  void judge();
  void drawPaged();
  void aim(const Band& part);
  double runMarking(const Band& part, std::uint32_t fresh_sample, bool accepts);
  bool bringPages();
  void bringForNext();
  struct WantedBlocks {
    std::uint64_t wanted = 0;
    std::uint64_t absent = 0;
  };
  std::span<const std::uint32_t> wantedBits(const PagedPart& part) const;
  std::span<const std::uint32_t> wantedBits(const PagedPart& part, std::uint32_t rank) const;
  bool hasRanks() const { return bound_.data.params.rank_words != 0; }
  std::vector<std::uint32_t> anyRank(const PagedPart& part) const;
  void sortByRank(const PagedPart& part, std::vector<std::uint32_t>& blocks) const;
  bool noteWanted(WantedBlocks& blocks);
  PagePool::Sweep sweep() const;
  std::uint64_t usedBytes() const;
  void awaitTurn();
  void noteFailure();
  int lookStride() const;
  int rowsInABand() const;
  bool looksAhead() const;
  void lookAhead();
  bool hasLookedAhead() const { return rows_ahead_ >= frame_.height; }
  std::size_t framePixels() const {
    return static_cast<std::size_t>(frame_.width) * static_cast<std::size_t>(frame_.height);
  }
  // Of so many rows of the picture.
  std::uint64_t sumBytes(int rows) const {
    return static_cast<std::uint64_t>(frame_.width) * static_cast<std::uint64_t>(rows) * kSumBytes;
  }
  bool bringInSome(PagedVoxels& voxels, std::chrono::milliseconds patience);
  void bringInWhatIsRead();
  bool bringAhead();
  void holdPages(std::optional<std::uint64_t> moment);
  void finish();

  FrameTools& tools_;
  const VulkanStep& volume_;
  const FrameOrder& order_;
  Plan plan_;
  OutputValues values_;
  Frame frame_;
  LevelShortage shortage_bytes_;

  std::size_t next_need_ = 0;
  Pins pins_;
  std::shared_ptr<const Slot> waits_for_;  // the part in the making, which does not give way meanwhile
  bool made_region_ = false;
  bool holds_ = false;
  bool found_no_room_ = false;
  std::exception_ptr shortage_;  // while it waits
  std::uint64_t ended_before_ = 0;

  bool is_begun_ = false;
  FrameBuffers buffers_;
  Kernels::Kernel kernel_;
  BoundFrame bound_;
  int sample_begin_ = 0;
  int sample_end_ = 1;
  std::unique_ptr<KeptPicture> kept_;  // sums of the whole picture; null: of a band alone
  std::optional<BandCutter> cutter_;

  // Of voxels that come and go.
  PagePool::Asker asker_;
  std::optional<BandPart> part_;     // of the band at hand, once it was drawn: some of its pixels lacked something
  double drawn_ms_ = 0;              // of that, when it was drawn first
  std::uint64_t begun_moment_ = 0;   // when rays looked first
  std::uint64_t moment_ = 0;         // and last
  std::uint64_t ahead_moment_ = 0;   // when it was looked ahead last
  std::uint64_t spared_moment_ = 0;  // of an order to bring in what may come: what was used since stays
  bool brings_pages_ = false;        // what they lacked is on its way
  bool is_short_ = false;            // of room, and cannot be cut smaller
  bool awaits_turn_ = false;         // beside what others hold
  int tries_alone_ = 0;              // to find room for a workgroup
  std::optional<std::uint64_t> held_moment_ = {};
  int rows_ahead_ = 0;  // how far down it was looked ahead
  int most_rows_ahead_ = kMaxImageSide;
  int looks_ = 0;  // at these rows
};

}  // namespace blockwalk
