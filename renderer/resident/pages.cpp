// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/pages.h"

#include <algorithm>
#include <cstddef>
#include <future>
#include <system_error>
#include <utility>

#include "shaders/kernel_interface.h"
#include "volume/error.h"
#include "volume/host_limits.h"

namespace blockwalk {
namespace {

// That is read at once, so that frames go on between.
constexpr std::uint64_t kBatchBytes = std::uint64_t{4} << 20;
// Of a thread, of neighbours that aprons are made from.
constexpr std::uint64_t kPageCacheBytes = std::uint64_t{8} << 20;
constexpr int kMostReaders = 4;

bool isDoneWith(const PagePool::Page& page, std::uint64_t keep_from, const PagePool::Sweep& sweep) {
  return page.asker == sweep.asker && page.used >= sweep.begun && page.used < std::min(keep_from, sweep.ahead);
}

}  // namespace

bool PagePool::makeRoom(std::uint64_t bytes, const Sweep& sweep) {
  if (bytes_ + bytes > most_bytes_) evict(bytes_ + bytes - most_bytes_, sweep);
  return bytes_ + bytes <= most_bytes_;
}

std::uint64_t PagePool::evict(std::uint64_t bytes, const Sweep& sweep) {
  const std::uint64_t before = bytes_;
  const std::uint64_t keep_from = held_.empty() ? moment_ + 1 : *held_.begin();
  Pages::iterator page = pages_.end();
  while (before - bytes_ < bytes && !pages_.empty() && pages_.back().used < keep_from) {
    if (page == pages_.end()) page = firstToGo(keep_from, sweep);
    const Pages::iterator next = std::next(page);
    const std::uint64_t changes = changes_ + 1;
    page->owner->drop(page);
    // What writes its address may itself have made room.
    const bool goes_on = changes_ == changes && next != pages_.end() && isDoneWith(*next, keep_from, sweep);
    page = goes_on ? next : pages_.end();
  }
  return before - bytes_;
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
  page->asker = asker;
  pages_.splice(pages_.begin(), pages_, page);
  ++changes_;
}

void PagePool::awaitTurn(Asker asker) {
  if (std::ranges::find(turns_, asker) == turns_.end()) turns_.push_back(asker);
}

PagePool::Pages::iterator PagePool::add(Page page) {
  bytes_ += page.voxels.bytes();
  pages_.push_front(std::move(page));
  ++changes_;
  return pages_.begin();
}

PagePool::Pages PagePool::unlink(Pages::iterator page) {
  bytes_ -= page->voxels.bytes();
  ++changes_;
  Pages alone;
  alone.splice(alone.begin(), pages_, page);
  return alone;
}

// To where it was: among those used as long ago.
PagePool::Pages::iterator PagePool::relink(Pages page) {
  bytes_ += page.front().voxels.bytes();
  ++changes_;
  const std::uint64_t used = page.front().used;
  const Pages::iterator at = page.begin();
  pages_.splice(std::ranges::find_if(pages_, [&](const Page& other) { return other.used <= used; }), page);
  return at;
}

PagedVoxels::PagedVoxels(Device& device, PagePool& pool, VisibleQuarters& quarters, const StoredVolume& volume,
                         const Need& need, std::shared_ptr<BlockReader> reader)
    : device_(device),
      pool_(pool),
      quarter_kernels_(quarters),
      file_(volume.file),
      need_(need),
      present_(reader->records()->blocks.size()) {
  readers_.push_back(std::move(reader));
  const auto most = static_cast<std::size_t>(std::min(kMostReaders, hostProcessors().to_use));
  while (readers_.size() < most) readers_.push_back(readers_.front()->another(kPageCacheBytes));
}

PagedVoxels::~PagedVoxels() {
  for (const auto& page : present_) {
    if (page) pool_.unlink(*page);
  }
}

std::vector<std::uint32_t> PagedVoxels::note(std::span<const std::uint32_t> bits, std::uint64_t moment, Asker asker) {
  std::vector<std::uint32_t> absent;
  forEachBit(bits, [&](std::uint32_t block) {
    if (!isPresent(block)) return absent.push_back(block);
    pool_.use(*present_[block], moment, asker);
  });
  return absent;
}

bool PagedVoxels::want(Asker asker, std::vector<std::uint32_t> blocks, const PagePool::Sweep& sweep) {
  std::erase_if(blocks, [this](std::uint32_t block) { return unreadable_.contains(block); });
  Wish& wish = wishes_[asker];
  wish.blocks = std::move(blocks);
  wish.sweep = sweep;
  return !wish.blocks.empty();
}

bool PagedVoxels::wasShort(Asker asker) {
  const auto wish = wishes_.find(asker);
  return wish != wishes_.end() && std::exchange(wish->second.is_short, false);
}

void PagedVoxels::tryAgain() {
  unreadable_.clear();
  failure_.clear();
}

bool PagedVoxels::advance(Asker asker, bool waits) {
  std::optional<Batch> read;
  const Asker read_for = batch_for_;
  if (batch_ != nullptr) {
    if (!(waits ? batch_->isReady() : batch_->isReadyNow())) return true;
    read = std::exchange(batch_, nullptr)->take();
  }
  startNext(read);  // read while the last one is copied
  if (read) {
    const auto wish = wishes_.find(read_for);
    const bool has_room = bringIn(*read, wish == wishes_.end() ? PagePool::Sweep{} : wish->second.sweep);
    if (!has_room && wish != wishes_.end()) wish->second = {.blocks = {}, .sweep = {}, .is_short = true};
  }
  const auto mine = wishes_.find(asker);
  return (batch_ != nullptr && batch_for_ == asker) || (mine != wishes_.end() && !mine->second.blocks.empty());
}

// Whoever follows the one that had the last batch, if there is somebody.
void PagedVoxels::startNext(const std::optional<Batch>& read) {
  auto next = wishes_.upper_bound(batch_for_);
  for (std::size_t i = 0; i < wishes_.size(); ++i, ++next) {
    if (next == wishes_.end()) next = wishes_.begin();
    std::vector<std::uint32_t>& wanted = next->second.blocks;
    std::erase_if(wanted, [&](std::uint32_t block) {
      return isPresent(block) || unreadable_.contains(block) ||
             (read && std::ranges::binary_search(read->blocks, block));
    });
    if (wanted.empty()) continue;
    batch_for_ = next->first;
    return startBatch(wanted);
  }
}

void PagedVoxels::startBatch(std::vector<std::uint32_t>& wanted) {
  const BlockReader& reader = *readers_.front();
  std::uint64_t bytes = 0;
  std::size_t count = 0;
  while (count < wanted.size() && (count == 0 || bytes < kBatchBytes)) bytes += reader.blockBytes(wanted[count++]);
  const auto end = wanted.begin() + static_cast<std::ptrdiff_t>(count);
  std::vector<std::uint32_t> blocks(wanted.begin(), end);
  wanted.erase(wanted.begin(), end);
  // Of the host and of what it shares alone: it may go on when this has ended.
  batch_ = std::make_unique<HostWork<Batch>>(
      [readers = readers_, blocks = std::move(blocks)] { return readBatch(readers, blocks); });
}

// Neighbours lie beside each other in the file: each thread has a run of the blocks.
PagedVoxels::Batch PagedVoxels::readBatch(const std::vector<std::shared_ptr<BlockReader>>& readers,
                                          std::vector<std::uint32_t> blocks) {
  Batch batch{.blocks = std::move(blocks), .voxels = {}, .failure = {}};
  const std::size_t count = batch.blocks.size();
  batch.voxels.resize(count);
  std::vector<std::string> failures(readers.size());
  const auto readRun = [&](std::size_t thread) {
    for (std::size_t i = count * thread / readers.size(); i < count * (thread + 1) / readers.size(); ++i) {
      std::vector<std::byte>& voxels = batch.voxels[i];
      voxels.resize(readers[thread]->blockBytes(batch.blocks[i]));
      try {
        readers[thread]->read(batch.blocks[i], 1, voxels);
      } catch (const DataError& error) {
        failures[thread] = error.what();
        voxels.clear();
      }
    }
  };
  std::vector<std::future<void>> others;
  for (std::size_t i = 1; i < readers.size(); ++i) {
    try {
      others.push_back(std::async(std::launch::async, readRun, i));
    } catch (const std::system_error&) {  // no thread to be had
      readRun(i);
    }
  }
  readRun(0);
  for (std::future<void>& other : others) other.get();
  for (std::string& failure : failures) {
    if (!failure.empty()) batch.failure = std::move(failure);
  }
  return batch;
}

// False where there is no room for all of it.
bool PagedVoxels::bringIn(const Batch& batch, const PagePool::Sweep& sweep) {
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < batch.blocks.size(); ++i) {
    if (!isPresent(batch.blocks[i])) bytes += batch.voxels[i].size();
  }
  pool_.makeRoom(bytes, sweep);  // at once, as far as that goes
  std::vector<std::uint32_t> arrived;
  bool has_room = true;
  for (std::size_t i = 0; i < batch.blocks.size() && has_room; ++i) {
    const std::uint32_t block = batch.blocks[i];
    if (batch.voxels[i].empty()) {
      unreadable_.insert(block);
      failure_ = batch.failure;
      continue;
    }
    if (isPresent(block)) continue;
    has_room = pool_.makeRoom(batch.voxels[i].size(), sweep);
    if (!has_room) break;
    PagePool::Page page{.owner = this, .block = block, .used = pool_.moment(), .asker = sweep.asker, .voxels = {}};
    try {
      page.voxels = Buffer(device_, batch.voxels[i].size(), BufferUse::resident);
      uploadBytes(device_, page.voxels, batch.voxels[i]);
      setAddress(block, page.voxels.address());
    } catch (const OutOfDeviceMemory&) {  // others have taken what the pool may have
      has_room = false;
      break;
    }
    bytes_ += page.voxels.bytes();
    present_[block] = pool_.add(std::move(page));
    arrived.push_back(block);
    ++arrived_;
  }
  for (const ResidentQuarters* quarters : quarters_) {
    quarter_kernels_.refresh(need_, file_->info(), *quarters, arrived);
  }
  return has_room;
}

// What writes the address may itself need room: the page is in no list by then.
void PagedVoxels::drop(PagePool::Pages::iterator page) {
  PagePool::Pages dropped = pool_.unlink(page);
  const std::uint32_t block = dropped.front().block;
  present_[block].reset();
  try {
    setAddress(block, 0);
  } catch (...) {  // the device still reads it
    present_[block] = pool_.relink(std::move(dropped));
    throw;
  }
  bytes_ -= dropped.front().voxels.bytes();
}

void PagedVoxels::setAddress(std::uint32_t block, std::uint64_t address) {
  if (blocks_ == nullptr) return;
  const auto bytes = std::as_bytes(std::span(&address, 1));
  const std::uint64_t at = block * sizeof(gpu::GpuBlock) + offsetof(gpu::GpuBlock, voxels);
  uploadBytes(device_, blocks_->records, at, bytes.size(),
              [&](std::uint64_t, std::span<std::byte> out) { std::ranges::copy(bytes, out.begin()); });
}

void PagedVoxels::follow(const ResidentBlocks* blocks) {
  blocks_ = blocks;
  for (std::uint32_t block = 0; block < present_.size(); ++block) {
    if (isPresent(block)) setAddress(block, (*present_[block])->voxels.address());
  }
}

void PagedVoxels::follow(const ResidentQuarters* quarters) {
  quarters_.push_back(quarters);
  std::vector<std::uint32_t> present;
  for (std::uint32_t block = 0; block < present_.size(); ++block) {
    if (isPresent(block)) present.push_back(block);
  }
  quarter_kernels_.refresh(need_, file_->info(), *quarters, present);
}

void PagedVoxels::leave(const ResidentBlocks* blocks) noexcept {
  if (blocks_ == blocks) blocks_ = nullptr;
}

void PagedVoxels::leave(const ResidentQuarters* quarters) noexcept { std::erase(quarters_, quarters); }

namespace {

class PagedMaking final : public Making {
 public:
  PagedMaking(Device& device, PagePool& pool, VisibleQuarters& quarters, const StoredVolume& volume, const Need& need)
      : device_(device),
        pool_(pool),
        quarters_(quarters),
        volume_(volume),
        need_(need),
        opening_([file = volume.file, need] { return std::make_shared<BlockReader>(file, need, kPageCacheBytes); }) {}

  std::unique_ptr<Resident> advance() override {
    if (!opening_.isReady()) return nullptr;
    std::shared_ptr<BlockReader> reader = opening_.take();
    auto made = std::make_unique<ResidentVoxels>();
    made->block_addresses.resize(reader->records()->blocks.size());
    made->records = reader->records();
    made->exponent = reader->exponent();
    made->pages = std::make_unique<PagedVoxels>(device_, pool_, quarters_, volume_, need_, std::move(reader));
    return made;
  }

 private:
  Device& device_;
  PagePool& pool_;
  VisibleQuarters& quarters_;
  StoredVolume volume_;
  Need need_;
  HostWork<std::shared_ptr<BlockReader>> opening_;
};

}  // namespace

std::unique_ptr<Making> makePagedVoxels(Device& device, PagePool& pool, VisibleQuarters& quarters,
                                        const StoredVolume& volume, const Need& need) {
  return std::make_unique<PagedMaking>(device, pool, quarters, volume, need);
}

}  // namespace blockwalk
