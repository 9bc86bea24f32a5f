// SPDX-License-Identifier: Apache-2.0
// Voxels of a level that come and go block by block: a page is the voxels of one block in one channel, with its apron
// where the filter needs one. What a block's record holds as the address of its voxels is 0 while they are absent.
//
//   kernel      a bit for each block that a ray came to
//     | note()  the present ones were used now; the others are absent
//   want()      in the order of the file
//     |         read, given their aprons and laid out on a thread of the host's, some at a time
//   advance()   memory, from the pool: what was used longest ago gives way (PagePool::Sweep says when not)
//     |         the voxels, the address in the block's record, the quarters of every range that is resident
//   kernel
//
// All belong to the thread that draws.
#pragma once

#include <bit>
#include <limits>
#include <list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "renderer/resident/block_reader.h"
#include "renderer/resident/host_work.h"
#include "renderer/resident/parts.h"
#include "renderer/resident/visible_quarters.h"

namespace blockwalk {

// What all paged voxels of a renderer share.
class PagePool {
 public:
  struct Page {
    PagedVoxels* owner = nullptr;
    std::uint32_t block = 0;
    std::uint64_t used = 0;   // the newest moment() at which a ray came to it
    std::uint64_t asker = 0;  // whose that was
    Buffer voxels;
  };
  using Pages = std::list<Page>;  // the one used last comes first

  explicit PagePool(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}

  std::uint64_t mostBytes() const { return most_bytes_; }
  std::uint64_t bytes() const { return bytes_; }
  // Counts the times that frames look: pages used at a moment or later can be kept apart from older ones.
  std::uint64_t moment() const { return moment_; }
  std::uint64_t nextMoment() { return ++moment_; }

  // What was used at this moment or later stays, until it is let go as often as it was held: a band is about to be
  // drawn with it.
  void hold(std::uint64_t moment) { held_.insert(moment); }
  void letGo(std::uint64_t moment) { held_.erase(held_.find(moment)); }

  // Whoever asks for pages, told apart from all others for ever.
  using Asker = std::uint64_t;
  Asker nextAsker() { return ++askers_; }
  // Who finds no room beside what others hold waits for a turn alone, holding nothing: until all have let go, and those
  // that waited before. Meanwhile nobody begins to hold, so that it comes.
  void awaitTurn(Asker asker);
  bool isAwaited() const { return !turns_.empty(); }
  bool hasTurn(Asker asker) const { return held_.empty() && !turns_.empty() && turns_.front() == asker; }
  void endTurn(Asker asker) noexcept { std::erase(turns_, asker); }
  // Nobody but who asks, who holds once at most.
  bool isHeldByOne() const { return held_.size() <= 1; }

  // A picture that is drawn from above to below, and the next one again. Since `begun` rays have looked for it, and
  // what they came to from `ahead` on is still to be drawn with.
  struct Sweep {
    Asker asker = 0;
    std::uint64_t begun = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t ahead = 0;
  };
  // Lets go of pages that nobody holds, the one used longest ago first, until so many bytes more may be taken. False
  // where that is not enough. Where all have been used since the sweep has begun it shows more than there is room for:
  // then of its own what it was done with last goes first, so that the next picture finds what it begins with.
  bool makeRoom(std::uint64_t bytes, const Sweep& sweep);
  // The same, until so many bytes have come back; how many did.
  std::uint64_t evict(std::uint64_t bytes, const Sweep& sweep);

 private:
  friend class PagedVoxels;
  Pages::iterator firstToGo(std::uint64_t keep_from, const Sweep& sweep);
  void use(Pages::iterator page, std::uint64_t moment, Asker asker);
  Pages::iterator add(Page page);
  Pages unlink(Pages::iterator page);  // a list of it alone
  Pages::iterator relink(Pages page);

  std::uint64_t most_bytes_;
  std::uint64_t bytes_ = 0;
  std::uint64_t moment_ = 0;
  std::multiset<std::uint64_t> held_;
  Asker askers_ = 0;
  std::vector<Asker> turns_;  // who has waited longest comes first
  Pages pages_;
  std::uint64_t changes_ = 0;  // of that list
};

inline std::uint32_t wordsOfBits(std::uint64_t bits) { return static_cast<std::uint32_t>((bits + 31) / 32); }

// Calls visit(i) for each bit i that is set, ascending.
template <typename Visit>
void forEachBit(std::span<const std::uint32_t> bits, Visit visit) {
  for (std::size_t word = 0; word < bits.size(); ++word) {
    for (std::uint32_t rest = bits[word]; rest != 0; rest &= rest - 1) {
      visit(static_cast<std::uint32_t>(32 * word) + static_cast<std::uint32_t>(std::countr_zero(rest)));
    }
  }
}

class PagedVoxels {
 public:
  // Device, pool and quarters outlive it.
  PagedVoxels(Device& device, PagePool& pool, VisibleQuarters& quarters, const StoredVolume& volume, const Need& need,
              std::shared_ptr<BlockReader> reader);
  ~PagedVoxels();
  PagedVoxels(const PagedVoxels&) = delete;
  PagedVoxels& operator=(const PagedVoxels&) = delete;

  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t arrived() const { return arrived_; }  // pages, so far
  std::uint64_t blockCount() const { return present_.size(); }

  // `bits` says block by block to which a ray came at `moment`. Those of them that are absent, ascending.
  using Asker = PagePool::Asker;
  std::vector<std::uint32_t> note(std::span<const std::uint32_t> bits, std::uint64_t moment, Asker asker);
  // What one asks for is not what another waits for.
  // What to bring in for him next, ascending, in place of what he wanted and has not begun; but for what could not be
  // read. False where that is nothing.
  bool want(Asker asker, std::vector<std::uint32_t> blocks, const PagePool::Sweep& sweep);
  // One piece of what anybody wants, by turns: true while there is more for him. Where there is no room beside what is
  // held the rest of it is not wanted any more. `waits`: a little, for what is being read.
  bool advance(Asker asker, bool waits);
  // Whether something was not brought in for him for want of room, since the last time that this was asked.
  bool wasShort(Asker asker);
  void forget(Asker asker) noexcept { wishes_.erase(asker); }
  // That the block's voxels take on the device.
  std::uint64_t blockBytes(std::uint32_t block) const { return readers_.front()->blockBytes(block); }

  // Why the last one that could not be read could not; empty: all could. Such blocks stay absent until tryAgain().
  const std::string& failure() const { return failure_; }
  void tryAgain();

  // The records of the blocks are kept right from now on; one at a time. And the quarters that may show something.
  void follow(const ResidentBlocks* blocks);
  void follow(const ResidentQuarters* quarters);
  void leave(const ResidentBlocks* blocks) noexcept;
  void leave(const ResidentQuarters* quarters) noexcept;

 private:
  friend class PagePool;
  struct Wish {
    std::vector<std::uint32_t> blocks;
    PagePool::Sweep sweep;
    bool is_short = false;
  };
  struct Batch {
    std::vector<std::uint32_t> blocks;
    std::vector<std::vector<std::byte>> voxels;  // of each, as they lie on the device; none of what cannot be read
    std::string failure;                         // why
  };
  bool isPresent(std::uint32_t block) const { return present_[block].has_value(); }
  void startNext(const std::optional<Batch>& read);
  void startBatch(std::vector<std::uint32_t>& wanted);
  static Batch readBatch(const std::vector<std::shared_ptr<BlockReader>>& readers, std::vector<std::uint32_t> blocks);
  bool bringIn(const Batch& batch, const PagePool::Sweep& sweep);
  void setAddress(std::uint32_t block, std::uint64_t address);
  void drop(PagePool::Pages::iterator page);

  Device& device_;
  PagePool& pool_;
  VisibleQuarters& quarter_kernels_;
  std::shared_ptr<const VolumeFile> file_;
  Need need_;
  std::vector<std::shared_ptr<BlockReader>> readers_;  // of the batch, while there is one: each on a thread of its own
  std::vector<std::optional<PagePool::Pages::iterator>> present_;  // by block
  std::uint64_t bytes_ = 0;
  std::uint64_t arrived_ = 0;
  std::map<Asker, Wish> wishes_;
  Asker batch_for_ = 0;  // that was begun last
  std::set<std::uint32_t> unreadable_;
  std::string failure_;
  std::unique_ptr<HostWork<Batch>> batch_;
  const ResidentBlocks* blocks_ = nullptr;
  std::vector<const ResidentQuarters*> quarters_;
};

// Part::voxels of a need that is paged: none of them, at first.
std::unique_ptr<Making> makePagedVoxels(Device& device, PagePool& pool, VisibleQuarters& quarters,
                                        const StoredVolume& volume, const Need& need);

}  // namespace blockwalk
