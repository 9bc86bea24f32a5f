// SPDX-License-Identifier: Apache-2.0
// Voxels of a level that come and go block by block: a page is the voxels of one block in one channel, with its apron
// where the filter needs one. What a block's record holds as the address of its voxels is 0 while they are absent.
//
//   kernel      a bit for each block that a ray came to
//     | note()  the present ones were used now; the others are absent
//   want()      in the order of the file, or as the view has it (Requests)
//     |         read, given their aprons and laid out on a thread of the host's, some at a time
//   advance()   memory, from the pool: what was used longest ago gives way (PagePool::Sweep says when not)
//     |         the voxels, the address in the block's record, the quarters of every range that is resident
//   kernel
//
// Windows of one level (renderer/plan/level_window.h) have records of their own, and share the pages of blocks that lie
// in both. All belong to the thread that draws.
#pragma once

#include <bit>
#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "renderer/resident/block_reader.h"
#include "renderer/resident/host_work.h"
#include "renderer/resident/page_pool.h"
#include "renderer/resident/parts.h"
#include "renderer/resident/visible_quarters.h"

namespace blockwalk {

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

  // Of a reading thread, of neighbours that aprons are made from.
  static constexpr std::uint64_t kCacheBytes = std::uint64_t{8} << 20;
  // That the host keeps of so many blocks: records, addresses, and which of them are present.
  static constexpr std::uint64_t hostBytes(std::uint64_t blocks) {
    return blocks * (sizeof(Block) + sizeof(std::uint64_t) + sizeof(std::optional<PagePool::Pages::iterator>));
  }
  // The same while they are read and linked, with the ranges of so many subblocks.
  static constexpr std::uint64_t readingBytes(const RecordCount& records) {
    return hostBytes(records.blocks) + records.blocks * sizeof(std::uint64_t) + records.subblocks * sizeof(Subblock);
  }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t arrived() const { return arrived_; }  // pages, so far
  std::uint64_t blockCount() const { return present_.size(); }

  // `bits` says block by block to which a ray came at `moment`. Those of them that were absent, ascending; what of them
  // another window of the level has is present from now on.
  using Asker = PagePool::Asker;
  std::vector<std::uint32_t> note(std::span<const std::uint32_t> bits, std::uint64_t moment, Asker asker);
  // What one asks for is not what another waits for.
  // What to bring in for him next, in that order, in place of what he wanted and has not begun; but for what could not
  // be read. False where that is nothing.
  bool want(Asker asker, std::vector<std::uint32_t> blocks, const PagePool::Sweep& sweep);
  // One piece of what anybody wants, by turns: true while there is more for him. Where there is no room beside what is
  // held the rest of it is not wanted any more. Waits so long for what is being read.
  bool advance(Asker asker, std::chrono::milliseconds patience);
  // Whether something was not brought in for him for want of room, since the last time that this was asked.
  bool wasShort(Asker asker);
  void forget(Asker asker) noexcept { wishes_.erase(asker); }
  // That the block's page takes.
  std::uint64_t blockBytes(std::uint32_t block) const {
    return PagePool::bytesFor(readers_.front()->blockBytes(block));
  }

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
    std::vector<std::uint32_t> blocks;           // in the order in which they are wanted
    std::vector<std::vector<std::byte>> voxels;  // of each, as they lie on the device; none of what cannot be read
    std::string failure;                         // why
  };
  bool isPresent(std::uint32_t block) const { return present_[block].has_value(); }
  void startNext(const std::optional<Batch>& read);
  void startBatch(std::vector<std::uint32_t>& wanted);
  void bringInFor(Asker asker, const PagePool::Sweep& begun_with, const Batch& batch);
  void dropCaches();
  static Batch readBatch(const std::vector<std::shared_ptr<BlockReader>>& readers, std::vector<std::uint32_t> blocks);
  bool bringIn(const Batch& batch, const PagePool::Sweep& sweep);
  void setAddress(std::uint32_t block, std::uint64_t address);
  bool isOfOneLevelWith(const PagedVoxels& other) const;
  std::optional<std::uint32_t> find(glm::ivec3 origin) const;
  std::vector<std::uint32_t> presentBlocks() const;
  void shareAbsent(std::span<const std::uint32_t> absent, std::uint64_t moment, Asker asker);
  void share(PagePool::Pages::iterator page, std::uint32_t block);
  void lose(std::uint32_t block, std::uint64_t bytes);
  void makeKnown(std::span<const std::uint32_t> arrived);

  Device& device_;
  PagePool& pool_;
  VisibleQuarters& quarter_kernels_;
  std::uint64_t volume_;
  std::shared_ptr<const VolumeFile> file_;
  Need need_;
  std::vector<std::shared_ptr<BlockReader>> readers_;  // of the batch, while there is one: each on a thread of its own
  std::vector<std::optional<PagePool::Pages::iterator>> present_;  // by block
  std::uint64_t bytes_ = 0;
  std::uint64_t arrived_ = 0;
  std::map<Asker, Wish> wishes_;
  Asker batch_for_ = 0;  // that was begun last
  PagePool::Sweep batch_sweep_;
  std::set<std::uint32_t> unreadable_;
  std::string failure_;
  std::unique_ptr<HostWork<Batch>> batch_;
  const ResidentBlocks* blocks_ = nullptr;
  std::vector<const ResidentQuarters*> quarters_;
};

}  // namespace blockwalk
