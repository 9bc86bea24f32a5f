// SPDX-License-Identifier: Apache-2.0
// What all paged voxels of a renderer share: the pages, and which of them gives way. Of the thread that draws.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <limits>
#include <list>
#include <set>
#include <utility>
#include <vector>

#include "renderer/resident/upload_pace.h"
#include "renderer/vulkan/host_share.h"
#include "renderer/vulkan/slice.h"

namespace blockwalk {

class PagedVoxels;

class PagePool {
 public:
  // Which block of whose records.
  struct Holder {
    PagedVoxels* voxels = nullptr;
    std::uint32_t block = 0;
  };
  struct Page {
    std::vector<Holder> holders;  // one for each window of the level whose records it is in
    std::uint64_t used = 0;       // the newest moment() at which a ray came to it
    std::uint64_t asker = 0;      // whose that was
    bool is_ahead = false;        // brought in for what may come, and not used yet
    Slice voxels;
    HostShare on_host;  // kHostBytes
    std::uint64_t bytes() const { return voxels.bytes() + on_host.bytes(); }
  };
  // Of a page beside its voxels: itself in a list, and one holder.
  static constexpr std::uint64_t kHostBytes = sizeof(Page) + sizeof(Holder) + 8 * sizeof(void*);
  // That one with so many bytes of voxels takes.
  static constexpr std::uint64_t bytesFor(std::uint64_t voxels) { return Slice::bytesFor(voxels) + kHostBytes; }
  using Pages = std::list<Page>;  // the one used last comes first

  explicit PagePool(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}

  std::uint64_t mostBytes() const { return most_bytes_; }
  std::uint64_t bytes() const { return bytes_; }
  // Counts the times that frames look: pages used at a moment or later can be kept apart from older ones.
  std::uint64_t moment() const { return moment_; }
  std::uint64_t nextMoment();
  // The first one that is no older.
  std::uint64_t momentSince(std::chrono::milliseconds age);
  // Pages that were brought in for what might come, and that it has come to since.
  std::uint64_t foreseen() const { return foreseen_; }

  // What was used at this moment or later stays, until it is let go as often as it was held: a band is about to be
  // drawn with it.
  void hold(std::uint64_t moment) { held_.insert(moment); }
  void letGo(std::uint64_t moment) { held_.erase(held_.find(moment)); }

  // Whoever asks for pages, told apart from all others for ever. Nobody looks for what may come.
  using Asker = std::uint64_t;
  static constexpr Asker kNobody = 0;
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
    // What was used at this moment or later does not give way for it.
    std::uint64_t spares = std::numeric_limits<std::uint64_t>::max();
    bool is_ahead = false;  // for what may come
  };
  // Lets go of pages that nobody holds, the one used longest ago first, until so many bytes more may be taken. False
  // where that is not enough. Where all have been used since the sweep has begun it shows more than there is room for:
  // then of its own what it was done with last goes first, so that the next picture finds what it begins with.
  bool makeRoom(std::uint64_t bytes, const Sweep& sweep);
  // The same, until so many bytes have come back; how many did.
  std::uint64_t evict(std::uint64_t bytes, const Sweep& sweep);

 private:
  friend class PagedVoxels;
  void drop(Pages::iterator page);
  Pages::iterator firstToGo(std::uint64_t keep_from, const Sweep& sweep);
  void use(Pages::iterator page, std::uint64_t moment, Asker asker);
  Pages::iterator add(Page page);
  void leave(Pages::iterator page, const PagedVoxels* voxels) noexcept;
  Pages unlink(Pages::iterator page);  // a list of it alone
  Pages::iterator relink(Pages page);

  std::uint64_t most_bytes_;
  std::uint64_t bytes_ = 0;
  std::uint64_t moment_ = 0;
  std::uint64_t foreseen_ = 0;
  std::deque<std::pair<std::chrono::steady_clock::time_point, std::uint64_t>> moments_;  // of late
  std::multiset<std::uint64_t> held_;
  Asker askers_ = 0;
  std::vector<Asker> turns_;  // who has waited longest comes first
  std::vector<PagedVoxels*> sharers_;
  Pages pages_;
  std::uint64_t changes_ = 0;  // of that list
  UploadPace pace_;
};

}  // namespace blockwalk
