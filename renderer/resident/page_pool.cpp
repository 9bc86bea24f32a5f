// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/page_pool.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "renderer/resident/pages.h"

namespace blockwalk {
namespace {

constexpr std::chrono::milliseconds kRemembered{2000};

bool isDoneWith(const PagePool::Page& page, std::uint64_t keep_from, const PagePool::Sweep& sweep) {
  return page.asker == sweep.asker && page.used >= sweep.begun && page.used < std::min(keep_from, sweep.ahead);
}

}  // namespace

std::uint64_t PagePool::nextMoment() {
  const auto now = std::chrono::steady_clock::now();
  moments_.emplace_back(now, ++moment_);
  while (now - moments_.front().first > kRemembered) moments_.pop_front();
  return moment_;
}

std::uint64_t PagePool::momentSince(std::chrono::milliseconds age) {
  const auto from = std::chrono::steady_clock::now() - std::min(age, kRemembered);
  const auto first = std::ranges::find_if(moments_, [&](const auto& moment) { return moment.first >= from; });
  return first == moments_.end() ? moment_ + 1 : first->second;
}

bool PagePool::makeRoom(std::uint64_t bytes, const Sweep& sweep) {
  if (bytes_ + bytes > most_bytes_) evict(bytes_ + bytes - most_bytes_, sweep);
  return bytes_ + bytes <= most_bytes_;
}

std::uint64_t PagePool::evict(std::uint64_t bytes, const Sweep& sweep) {
  const std::uint64_t before = bytes_;
  const std::uint64_t keep_from = std::min(held_.empty() ? moment_ + 1 : *held_.begin(), sweep.spares);
  Pages::iterator page = pages_.end();
  while (before - bytes_ < bytes && !pages_.empty() && pages_.back().used < keep_from) {
    if (page == pages_.end()) page = firstToGo(keep_from, sweep);
    const Pages::iterator next = std::next(page);
    const std::uint64_t changes = changes_ + 1;
    drop(page);
    // What writes its address may itself have made room.
    const bool goes_on = changes_ == changes && next != pages_.end() && isDoneWith(*next, keep_from, sweep);
    page = goes_on ? next : pages_.end();
  }
  return before - bytes_;
}

void PagePool::drop(Pages::iterator page) {
  Pages dropped = unlink(page);
  std::vector<Holder>& holders = dropped.front().holders;
  try {
    for (; !holders.empty(); holders.pop_back()) {
      holders.back().voxels->lose(holders.back().block, dropped.front().bytes());
    }
  } catch (...) {  // the device still reads it
    relink(std::move(dropped));
    throw;
  }
}

// Whoever is gone needs no address any more.
void PagePool::leave(Pages::iterator page, const PagedVoxels* voxels) noexcept {
  std::erase_if(page->holders, [&](const Holder& holder) { return holder.voxels == voxels; });
  if (page->holders.empty()) unlink(page);
}

PagePool::Pages::iterator PagePool::firstToGo(std::uint64_t keep_from, const Sweep& sweep) {
  const Pages::iterator oldest = std::prev(pages_.end());
  // The one used last comes first: where the oldest is still to be drawn with there is none before it that is not.
  if (oldest->used < sweep.begun || oldest->used >= std::min(keep_from, sweep.ahead)) return oldest;
  const Pages::iterator newest =
      std::ranges::find_if(pages_, [&](const Page& page) { return isDoneWith(page, keep_from, sweep); });
  return newest == pages_.end() ? oldest : newest;
}

void PagePool::use(Pages::iterator page, std::uint64_t moment, Asker asker) {
  page->used = moment;
  if (asker != kNobody) {
    page->asker = asker;
    if (std::exchange(page->is_ahead, false)) ++foreseen_;
  }
  pages_.splice(pages_.begin(), pages_, page);
  ++changes_;
}

void PagePool::awaitTurn(Asker asker) {
  if (std::ranges::find(turns_, asker) == turns_.end()) turns_.push_back(asker);
}

PagePool::Pages::iterator PagePool::add(Page page) {
  bytes_ += page.bytes();
  pages_.push_front(std::move(page));
  ++changes_;
  return pages_.begin();
}

PagePool::Pages PagePool::unlink(Pages::iterator page) {
  bytes_ -= page->bytes();
  ++changes_;
  Pages alone;
  alone.splice(alone.begin(), pages_, page);
  return alone;
}

// To where it was: among those used as long ago.
PagePool::Pages::iterator PagePool::relink(Pages page) {
  bytes_ += page.front().bytes();
  ++changes_;
  const std::uint64_t used = page.front().used;
  const Pages::iterator at = page.begin();
  pages_.splice(std::ranges::find_if(pages_, [&](const Page& other) { return other.used <= used; }), page);
  return at;
}

}  // namespace blockwalk
