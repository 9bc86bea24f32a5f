// SPDX-License-Identifier: Apache-2.0
// Where the pages of a channel of a level lie. Of many, groups are kept that were asked for last.
#pragma once

#include <array>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <unordered_map>
#include <vector>

#include "volume/file/record_reader.h"

namespace blockwalk {

// One page as a reader needs it.
struct Page {
  std::uint64_t checksum = 0;
  std::uint64_t offset = 0;          // in the volume
  std::uint64_t first_subblock = 0;  // of the level
  std::uint32_t bytes = 0;           // in the file
  Codec codec = Codec::raw;
  std::uint8_t subblocks = 0;
};

// Where some that follow each other begin.
struct PageGroup {
  std::uint64_t first_page = 0;      // of the level
  std::uint64_t first_subblock = 0;  // of the level
  std::uint64_t offset = 0;          // of its first page's bytes, in the volume
  std::uint64_t checksum = 0;        // XXH3-64 of its entries
};

class PageTable {
 public:
  // Reads all entries once, and holds them against their checksum and the level's counts. Throws DataError naming the
  // record's offset, the field and the bound. What `place` and `info` refer to outlives the table.
  PageTable(RecordPlace place, const VolumeInfo& info, ReadBytes read);
  // Of groups that are known, behind which comes the end: reads entries when they are asked for.
  PageTable(RecordPlace place, const VolumeInfo& info, ReadBytes read, std::vector<PageGroup> groups)
      : place_(std::move(place)), info_(info), read_(std::move(read)), groups_(std::move(groups)) {}

  // Those in which subblocks of [first, first + count) lie, in their order. Any thread.
  std::vector<Page> pagesOf(std::uint64_t first, std::uint64_t count) const;
  // Throws DataError unless each of the blocks, ascending, has the page that its stored subblocks need.
  void check(std::span<const Block> blocks) const;
  // How many there are by codec, where all were read.
  const std::array<std::uint64_t, kCodecs>& byCodec() const { return by_codec_; }

 private:
  using Pages = std::vector<Page>;
  struct Kept {
    std::shared_ptr<const Pages> pages;
    std::list<std::size_t>::iterator age;
  };

  Pages decode(SectionReader& section, std::uint64_t count, PageGroup at) const;
  std::size_t groupOf(std::uint64_t subblock) const;
  std::shared_ptr<const Pages> group(std::size_t number) const;
  void keep(std::size_t number, std::shared_ptr<const Pages> pages) const;

  RecordPlace place_;
  const VolumeInfo& info_;
  ReadBytes read_;
  std::vector<PageGroup> groups_;  // and the end
  std::array<std::uint64_t, kCodecs> by_codec_{};
  mutable std::mutex mutex_;
  mutable std::unordered_map<std::size_t, Kept> kept_;
  mutable std::list<std::size_t> ages_;  // most recent first
};

}  // namespace blockwalk
