// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/paged_making.h"

#include <optional>
#include <utility>

#include "renderer/resident/host_work.h"
#include "renderer/resident/pages.h"
#include "renderer/resident/parts.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

class PagedMaking final : public Making {
 public:
  PagedMaking(Device& device, PagePool& pool, VisibleQuarters& quarters, const StoredVolume& volume, const Need& need)
      : device_(device), pool_(pool), quarters_(quarters), volume_(volume), need_(need) {
    const VolumeInfo& info = volume_.file->info();
    if (need_.window.holds(latticeDims(info.level(need_.level, need_.form).dims, info.blockVoxels()))) {
      open(volume_.file->mostRecords(need_.level, need_.form, need_.apron, need_.window));
    } else {
      count(&VolumeFile::mostRecords);
    }
  }

  std::unique_ptr<Resident> advance() override {
    if (!opening_) {
      if (counting_->isReady()) openWhereItFits();
      return nullptr;
    }
    if (!opening_->isReady()) return nullptr;
    std::shared_ptr<BlockReader> reader = opening_->take();
    reading_ = {};
    auto made = std::make_unique<ResidentVoxels>();
    made->block_addresses.resize(reader->records()->blocks.size());
    made->records = reader->records();
    made->ranges = std::make_shared<const std::vector<Subblock>>(reader->takeRanges());
    made->exponent = reader->exponent();
    made->on_host = HostShare(device_, PagedVoxels::hostBytes(made->records->blocks.size()) + reader->aroundBytes());
    made->ranges_on_host = HostShare(device_, made->ranges->size() * sizeof(Subblock));
    made->pages = std::make_unique<PagedVoxels>(device_, pool_, quarters_, volume_, need_, std::move(reader));
    return made;
  }
  std::uint64_t bytes() const override { return reading_.bytes(); }

 private:
  using Count = RecordCount (VolumeFile::*)(int, Form, bool, const BlockWindow&) const;
  void count(Count how) {
    counting_.emplace([file = volume_.file, need = need_, how] {
      return ((*file).*how)(need.level, need.form, need.apron, need.apron ? need.window.grown() : need.window);
    });
  }

  // On the host while it is read, and then on the device.
  static std::uint64_t bytesOf(const RecordCount& records) {
    return PagedVoxels::readingBytes(records) + records.blocks * sizeof(gpu::GpuBlock);
  }

  // It is known at once how many there are at most, and takes a look at them how many there are.
  void openWhereItFits() {
    const RecordCount records = counting_->take();
    counting_.reset();
    if (!is_counted_ && bytesOf(records) > device_.freeBytes()) {
      is_counted_ = true;
      count(&VolumeFile::countRecords);
    } else {
      open(records);
    }
  }

  void open(const RecordCount& records) {
    device_.makeRoom(bytesOf(records));
    reading_ = HostShare(device_, PagedVoxels::readingBytes(records));
    opening_.emplace([file = volume_.file, need = need_] {
      return std::make_shared<BlockReader>(file, need, PagedVoxels::kCacheBytes);
    });
  }

  Device& device_;
  PagePool& pool_;
  VisibleQuarters& quarters_;
  StoredVolume volume_;
  Need need_;
  std::optional<HostWork<RecordCount>> counting_;
  bool is_counted_ = false;  // one by one
  HostShare reading_;
  std::optional<HostWork<std::shared_ptr<BlockReader>>> opening_;
};

}  // namespace

std::unique_ptr<Making> makePagedVoxels(Device& device, PagePool& pool, VisibleQuarters& quarters,
                                        const StoredVolume& volume, const Need& need) {
  return std::make_unique<PagedMaking>(device, pool, quarters, volume, need);
}

}  // namespace blockwalk
