// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/pages.h"

#include <algorithm>
#include <cstddef>
#include <future>
#include <numeric>
#include <system_error>
#include <utility>

#include "shaders/kernel_interface.h"
#include "volume/error.h"
#include "volume/host_limits.h"

namespace blockwalk {
namespace {

constexpr int kMostReaders = 4;

}  // namespace

PagedVoxels::PagedVoxels(Device& device, PagePool& pool, VisibleQuarters& quarters, const StoredVolume& volume,
                         const Need& need, std::shared_ptr<BlockReader> reader)
    : device_(device),
      pool_(pool),
      quarter_kernels_(quarters),
      volume_(volume.serial),
      file_(volume.file),
      need_(need),
      present_(reader->records()->blocks.size()) {
  readers_.push_back(std::move(reader));
  const auto most = static_cast<std::size_t>(std::min(kMostReaders, hostProcessors().to_use));
  while (readers_.size() < most) readers_.push_back(readers_.front()->another(kCacheBytes));
  pool_.sharers_.push_back(this);
}

PagedVoxels::~PagedVoxels() {
  std::erase(pool_.sharers_, this);
  for (const auto& page : present_) {
    if (page) pool_.leave(*page, this);
  }
}

bool PagedVoxels::isOfOneLevelWith(const PagedVoxels& other) const {
  Need need = other.need_;
  need.window = need_.window;
  return &other != this && other.volume_ == volume_ && need == need_;
}

std::optional<std::uint32_t> PagedVoxels::find(glm::ivec3 origin) const {
  const std::vector<Block>& blocks = readers_.front()->records()->blocks;
  const auto codeOf = [](const Block& block) { return mortonCode(glm::uvec3(block.origin)); };
  const std::uint64_t code = mortonCode(glm::uvec3(origin));
  const auto found = std::ranges::lower_bound(blocks, code, {}, codeOf);
  if (found == blocks.end() || codeOf(*found) != code) return std::nullopt;
  return static_cast<std::uint32_t>(found - blocks.begin());
}

// The address before all else: what cannot be written is not shared.
void PagedVoxels::share(PagePool::Pages::iterator page, std::uint32_t block) {
  setAddress(block, page->voxels.address());
  page->holders.push_back({.voxels = this, .block = block});
  present_[block] = page;
  bytes_ += page->bytes();
}

void PagedVoxels::lose(std::uint32_t block, std::uint64_t bytes) {
  setAddress(block, 0);
  present_[block].reset();
  bytes_ -= bytes;
}

std::vector<std::uint32_t> PagedVoxels::note(std::span<const std::uint32_t> bits, std::uint64_t moment, Asker asker) {
  std::vector<std::uint32_t> absent;
  forEachBit(bits, [&](std::uint32_t block) {
    if (!isPresent(block)) return absent.push_back(block);
    pool_.use(*present_[block], moment, asker);
  });
  shareAbsent(absent, moment, asker);
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

bool PagedVoxels::advance(Asker asker, std::chrono::milliseconds patience) {
  std::optional<Batch> read;
  const Asker read_for = batch_for_;
  const PagePool::Sweep begun_with = batch_sweep_;
  if (batch_ != nullptr) {
    if (!batch_->isReadyWithin(patience)) return true;
    read = std::exchange(batch_, nullptr)->take();
  }
  startNext(read);  // read while the last one is copied
  if (read) bringInFor(read_for, begun_with, *read);
  if (batch_ == nullptr) dropCaches();
  const auto mine = wishes_.find(asker);
  return (batch_ != nullptr && batch_for_ == asker) || (mine != wishes_.end() && !mine->second.blocks.empty());
}

// What was read for one who has gone since takes no more room than it might have then.
void PagedVoxels::bringInFor(Asker asker, const PagePool::Sweep& begun_with, const Batch& batch) {
  const auto wish = wishes_.find(asker);
  if (wish == wishes_.end()) {
    bringIn(batch, {.spares = begun_with.spares, .is_ahead = begun_with.is_ahead});
  } else if (!bringIn(batch, wish->second.sweep)) {
    wish->second = {.blocks = {}, .sweep = {}, .is_short = true};
  }
}

// Whoever follows the one that had the last batch, if there is somebody.
void PagedVoxels::startNext(const std::optional<Batch>& read) {
  std::vector<std::uint32_t> has_been_read = read ? read->blocks : std::vector<std::uint32_t>();
  std::ranges::sort(has_been_read);
  auto next = wishes_.upper_bound(batch_for_);
  for (std::size_t i = 0; i < wishes_.size(); ++i, ++next) {
    if (next == wishes_.end()) next = wishes_.begin();
    std::vector<std::uint32_t>& wanted = next->second.blocks;
    std::erase_if(wanted, [&](std::uint32_t block) {
      return isPresent(block) || unreadable_.contains(block) || std::ranges::binary_search(has_been_read, block);
    });
    if (wanted.empty()) continue;
    batch_for_ = next->first;
    batch_sweep_ = next->second.sweep;
    return startBatch(wanted);
  }
}

// Of what was read: only what lies beside it in the file makes use of that.
void PagedVoxels::dropCaches() {
  for (const std::shared_ptr<BlockReader>& reader : readers_) reader->dropCache();
}

void PagedVoxels::startBatch(std::vector<std::uint32_t>& wanted) {
  const BlockReader& reader = *readers_.front();
  std::uint64_t bytes = 0;
  std::size_t count = 0;
  while (count < wanted.size() && (count == 0 || bytes < pool_.pace_.bytes()))
    bytes += PagePool::bytesFor(reader.blockBytes(wanted[count++]));
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
  std::vector<std::size_t> in_file(count);
  std::iota(in_file.begin(), in_file.end(), std::size_t{0});
  std::ranges::sort(in_file, {}, [&](std::size_t i) { return batch.blocks[i]; });
  std::vector<std::string> failures(readers.size());
  try {
    readers.front()->expect(batch.blocks);
  } catch (const DataError&) {  // whoever reads them says why
  }
  const auto readRun = [&](std::size_t thread) {
    for (std::size_t at = count * thread / readers.size(); at < count * (thread + 1) / readers.size(); ++at) {
      const std::uint32_t block = batch.blocks[in_file[at]];
      std::vector<std::byte>& voxels = batch.voxels[in_file[at]];
      voxels.resize(readers[thread]->blockBytes(block));
      try {
        readers[thread]->read(block, 1, voxels);
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
  const auto begun = std::chrono::steady_clock::now();
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < batch.blocks.size(); ++i) {
    if (!isPresent(batch.blocks[i])) bytes += PagePool::bytesFor(batch.voxels[i].size());
  }
  pool_.makeRoom(bytes, sweep);  // at once, as far as that goes
  std::vector<std::uint32_t> arrived;
  std::uint64_t arrived_bytes = 0;
  bool has_room = true;
  for (std::size_t i = 0; i < batch.blocks.size() && has_room; ++i) {
    const std::uint32_t block = batch.blocks[i];
    if (batch.voxels[i].empty()) {
      unreadable_.insert(block);
      failure_ = batch.failure;
      continue;
    }
    if (isPresent(block)) continue;
    has_room = pool_.makeRoom(PagePool::bytesFor(batch.voxels[i].size()), sweep);
    if (!has_room) break;
    PagePool::Page page{.holders = {{.voxels = this, .block = block}},
                        .used = pool_.moment(),
                        .asker = sweep.asker,
                        .is_ahead = sweep.is_ahead,
                        .voxels = {},
                        .on_host = {}};
    try {
      page.voxels = Slice(device_, batch.voxels[i].size());
      page.voxels.upload(batch.voxels[i]);
      page.on_host = HostShare(device_, PagePool::kHostBytes);
      setAddress(block, page.voxels.address());
    } catch (const OutOfDeviceMemory&) {  // others have taken what the pool may have
      has_room = false;
      break;
    }
    bytes_ += page.bytes();
    present_[block] = pool_.add(std::move(page));
    arrived.push_back(block);
    arrived_bytes += (*present_[block])->bytes();
    ++arrived_;
  }
  std::ranges::sort(arrived);
  makeKnown(arrived);
  pool_.pace_.took(arrived_bytes,
                   std::chrono::duration_cast<UploadPace::Time>(std::chrono::steady_clock::now() - begun));
  return has_room;
}

// Of blocks that are absent here, those that are present in another window of the level.
void PagedVoxels::shareAbsent(std::span<const std::uint32_t> absent, std::uint64_t moment, Asker asker) {
  if (absent.empty()) return;
  std::vector<std::uint32_t> shared;
  for (const PagedVoxels* other : pool_.sharers_) {
    if (!isOfOneLevelWith(*other)) continue;
    for (const std::uint32_t block : absent) {
      if (isPresent(block)) continue;
      const std::optional<std::uint32_t> theirs = other->find(readers_.front()->records()->blocks[block].origin);
      if (!theirs || !other->isPresent(*theirs)) continue;
      share(*other->present_[*theirs], block);
      pool_.use(*present_[block], moment, asker);
      shared.push_back(block);
    }
  }
  std::ranges::sort(shared);
  makeKnown(shared);
}

// Of blocks whose voxels have come: which quarters may show something.
void PagedVoxels::makeKnown(std::span<const std::uint32_t> arrived) {
  if (arrived.empty()) return;
  for (const ResidentQuarters* quarters : quarters_) {
    quarter_kernels_.refresh(need_, file_->info(), *quarters, arrived);
  }
}

// Takes no memory: what gives way for some could be what is written.
void PagedVoxels::setAddress(std::uint32_t block, std::uint64_t address) {
  if (blocks_ == nullptr) return;
  const std::uint64_t at = block * sizeof(gpu::GpuBlock) + offsetof(gpu::GpuBlock, voxels);
  writeWord(device_, blocks_->records, at, address);
}

void PagedVoxels::follow(const ResidentBlocks* blocks) {
  blocks_ = blocks;
  for (std::uint32_t block = 0; block < present_.size(); ++block) {
    if (isPresent(block)) setAddress(block, (*present_[block])->voxels.address());
  }
}

void PagedVoxels::follow(const ResidentQuarters* quarters) {
  quarters_.push_back(quarters);
  quarter_kernels_.refresh(need_, file_->info(), *quarters, presentBlocks());
}

std::vector<std::uint32_t> PagedVoxels::presentBlocks() const {
  std::vector<std::uint32_t> present;
  for (std::uint32_t block = 0; block < present_.size(); ++block) {
    if (isPresent(block)) present.push_back(block);
  }
  return present;
}

void PagedVoxels::leave(const ResidentBlocks* blocks) noexcept {
  if (blocks_ == blocks) blocks_ = nullptr;
}

void PagedVoxels::leave(const ResidentQuarters* quarters) noexcept { std::erase(quarters_, quarters); }

}  // namespace blockwalk
