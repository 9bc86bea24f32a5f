// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/pages.h"

#include <algorithm>
#include <bit>
#include <cstddef>

#include "renderer/plan/aproned_layout.h"
#include "renderer/plan/density_scale.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

// That is read at once, so that frames go on between.
constexpr std::uint64_t kBatchBytes = std::uint64_t{4} << 20;
// Of neighbours that aprons are made from.
constexpr std::uint64_t kCacheBytes = std::uint64_t{16} << 20;

}  // namespace

bool PagePool::makeRoom(std::uint64_t bytes) {
  if (bytes_ + bytes > most_bytes_) evict(bytes_ + bytes - most_bytes_);
  return bytes_ + bytes <= most_bytes_;
}

std::uint64_t PagePool::evict(std::uint64_t bytes) {
  const std::uint64_t before = bytes_;
  const std::uint64_t keep_from = held_.empty() ? moment_ + 1 : *held_.begin();
  while (before - bytes_ < bytes && !pages_.empty() && pages_.back().used < keep_from) {
    pages_.back().owner->drop(std::prev(pages_.end()));
  }
  return before - bytes_;
}

PagePool::Pages::iterator PagePool::add(Page page) {
  bytes_ += page.voxels.bytes();
  pages_.push_front(std::move(page));
  return pages_.begin();
}

void PagePool::remove(Pages::iterator page) {
  bytes_ -= page->voxels.bytes();
  pages_.erase(page);
}

ResidentVoxels::ResidentVoxels() = default;
ResidentVoxels::~ResidentVoxels() = default;

std::uint64_t ResidentVoxels::bytes() const {
  std::uint64_t sum = pages != nullptr ? pages->bytes() : 0;
  for (const Buffer& chunk : chunks) sum += chunk.bytes();
  return sum;
}

ResidentBlocks::~ResidentBlocks() {
  if (voxels != nullptr && voxels->pages != nullptr) voxels->pages->leave(this);
}

ResidentQuarters::~ResidentQuarters() {
  if (blocks != nullptr && blocks->voxels->pages != nullptr) blocks->voxels->pages->leave(this);
}

PagedVoxels::PagedVoxels(Device& device, PagePool& pool, VisibleQuarters& quarters, const StoredVolume& volume,
                         const Need& need, std::shared_ptr<const Level> records, std::shared_ptr<ApronLevel> apron)
    : device_(device),
      pool_(pool),
      quarter_kernels_(quarters),
      file_(volume.file),
      need_(need),
      subblock_bytes_(deviceSubblockBytes(volume.file->info(), need.apron)),
      exponent_(densityExponent(volume.file->info(), static_cast<std::size_t>(need.channel))),
      records_(std::move(records)),
      apron_(std::move(apron)),
      present_(records_->blocks.size()) {}

PagedVoxels::~PagedVoxels() {
  for (const auto& page : present_) {
    if (page) pool_.remove(*page);
  }
}

std::uint64_t PagedVoxels::pageBytes(std::uint32_t block) const {
  return records_->blocks[block].subblock_count * subblock_bytes_;
}

std::vector<std::uint32_t> PagedVoxels::note(std::span<const std::uint32_t> bits, std::uint64_t moment) {
  std::vector<std::uint32_t> absent;
  for (std::size_t word = 0; word < bits.size(); ++word) {
    for (std::uint32_t rest = bits[word]; rest != 0; rest &= rest - 1) {
      const auto block = static_cast<std::uint32_t>(32 * word) + static_cast<std::uint32_t>(std::countr_zero(rest));
      if (!isPresent(block)) {
        absent.push_back(block);
        continue;
      }
      (*present_[block])->used = moment;
      pool_.pages_.splice(pool_.pages_.begin(), pool_.pages_, *present_[block]);
    }
  }
  return absent;
}

bool PagedVoxels::advance(bool waits) {
  if (batch_ != nullptr) {
    if (!(waits ? batch_->isReady() : batch_->isReadyNow())) return true;
    const Batch batch = std::exchange(batch_, nullptr)->take();
    if (!bringIn(batch)) {
      wanted_.clear();
      is_short_ = true;
    }
  }
  std::erase_if(wanted_, [this](std::uint32_t block) { return isPresent(block); });
  if (wanted_.empty()) return false;
  startBatch();
  return true;
}

void PagedVoxels::startBatch() {
  std::uint64_t bytes = 0;
  std::size_t count = 0;
  while (count < wanted_.size() && (count == 0 || bytes < kBatchBytes)) bytes += pageBytes(wanted_[count++]);
  std::vector<std::uint32_t> blocks(wanted_.begin(), wanted_.begin() + static_cast<std::ptrdiff_t>(count));
  wanted_.erase(wanted_.begin(), wanted_.begin() + static_cast<std::ptrdiff_t>(count));
  // Of the host and of what it shares alone: it may go on when this has ended.
  batch_ = std::make_unique<HostWork<Batch>>([file = file_, need = need_, records = records_, apron = apron_,
                                              blocks = std::move(blocks), subblock_bytes = subblock_bytes_,
                                              exponent = exponent_] {
    Batch batch{.blocks = blocks, .voxels = {}};
    std::vector<std::byte> plain;
    for (const std::uint32_t block : blocks) {
      const Block& record = records->blocks[block];
      std::vector<std::byte>& voxels = batch.voxels.emplace_back(record.subblock_count * subblock_bytes);
      if (apron != nullptr) {
        plain.resize(record.subblock_count * apron->subblockBytes());
        apron->readBlock(block, plain);
        layOutAproned(file->info(), plain, voxels);
      } else {
        file->readVoxels(need.level, need.channel, record.first_subblock, record.subblock_count, voxels, need.form);
      }
      toDevice(voxels, exponent);
    }
    return batch;
  });
}

// False where there is no room for all of it.
bool PagedVoxels::bringIn(const Batch& batch) {
  std::vector<std::uint32_t> arrived;
  bool has_room = true;
  for (std::size_t i = 0; i < batch.blocks.size() && has_room; ++i) {
    const std::uint32_t block = batch.blocks[i];
    if (isPresent(block)) continue;
    has_room = pool_.makeRoom(batch.voxels[i].size());
    if (!has_room) break;
    PagePool::Page page{.owner = this, .block = block, .used = pool_.moment(), .voxels = {}};
    try {
      page.voxels = Buffer(device_, batch.voxels[i].size(), BufferUse::resident);
    } catch (const OutOfDeviceMemory&) {  // others have taken what the pool may have
      has_room = false;
      break;
    }
    uploadBytes(device_, page.voxels, batch.voxels[i]);
    bytes_ += page.voxels.bytes();
    present_[block] = pool_.add(std::move(page));
    setAddress(block, (*present_[block])->voxels.address());
    arrived.push_back(block);
    ++arrived_;
  }
  for (const ResidentQuarters* quarters : quarters_) {
    quarter_kernels_.refresh(need_, file_->info(), *quarters, arrived);
  }
  return has_room;
}

void PagedVoxels::drop(PagePool::Pages::iterator page) {
  const std::uint32_t block = page->block;
  setAddress(block, 0);
  bytes_ -= page->voxels.bytes();
  present_[block].reset();
  pool_.remove(page);
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
        opening_([file = volume.file, need] {
          Opened opened;
          if (need.apron) {
            opened.apron = std::make_shared<ApronLevel>(*file, need.level, need.channel, need.form, kCacheBytes);
            opened.records = std::make_shared<const Level>(opened.apron->records());
          } else {
            opened.records = std::make_shared<const Level>(file->readLevel(need.level, need.channel, need.form));
          }
          return opened;
        }) {}

  std::unique_ptr<Resident> advance() override {
    if (!opening_.isReady()) return nullptr;
    Opened opened = opening_.take();
    auto made = std::make_unique<ResidentVoxels>();
    made->block_addresses.resize(opened.records->blocks.size());
    made->records = opened.records;
    made->exponent = densityExponent(volume_.file->info(), static_cast<std::size_t>(need_.channel));
    made->pages = std::make_unique<PagedVoxels>(device_, pool_, quarters_, volume_, need_, std::move(opened.records),
                                                std::move(opened.apron));
    return made;
  }

 private:
  struct Opened {
    std::shared_ptr<const Level> records;
    std::shared_ptr<ApronLevel> apron;
  };
  Device& device_;
  PagePool& pool_;
  VisibleQuarters& quarters_;
  StoredVolume volume_;
  Need need_;
  HostWork<Opened> opening_;
};

}  // namespace

std::unique_ptr<Making> makePagedVoxels(Device& device, PagePool& pool, VisibleQuarters& quarters,
                                        const StoredVolume& volume, const Need& need) {
  return std::make_unique<PagedMaking>(device, pool, quarters, volume, need);
}

}  // namespace blockwalk
