// SPDX-License-Identifier: Apache-2.0
#include "volume/file/page_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <utility>

#include "volume/file/records.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kGroupPages = 1024;
constexpr std::size_t kMostKept = 64;  // groups: 2 MiB

}  // namespace

PageTable::PageTable(RecordPlace place, const VolumeInfo& info, ReadBytes read)
    : place_(std::move(place)), info_(info), read_(std::move(read)) {
  const Section& pages = place_.sections.pages;
  const std::uint64_t count = pages.bytes / sizeof(PageEntry);
  SectionReader section(read_, pages.offset, pages.bytes);
  withChecksum(place_, "pages", section, pages.checksum, [&] {
    PageGroup next{.offset = place_.sections.voxels.offset};
    for (std::uint64_t done = 0; done < count; done += kGroupPages) {
      next.checksum = checksumOf(section.ahead(std::min(kGroupPages, count - done) * sizeof(PageEntry)));
      auto group = std::make_shared<const Pages>(decode(section, std::min(kGroupPages, count - done), next));
      for (const Page& page : *group) ++by_codec_[static_cast<std::size_t>(page.codec)];
      groups_.push_back(next);
      const Page& last = group->back();
      next.first_page = done + group->size();
      next.first_subblock = last.first_subblock + last.subblocks;
      next.offset = last.offset + last.bytes;
      if (groups_.size() <= kMostKept) keep(groups_.size() - 1, std::move(group));
    }
    const RecordCheck check(place_, section.offset());
    check(next.first_subblock == place_.entry.subblock_count, "subblocks of all pages", next.first_subblock,
          "the level's subblock_count");
    const std::uint64_t bytes = next.offset - place_.sections.voxels.offset;
    check(bytes == place_.sections.voxels.bytes, "bytes of all pages", bytes, "the size of the voxels");
    next.checksum = 0;
    groups_.push_back(next);
  });
}

PageTable::Pages PageTable::decode(SectionReader& section, std::uint64_t count, PageGroup at) const {
  const std::uint64_t subblock_bytes = info_.subblockVoxels() * voxelBytes(info_.type);
  const int per_block = info_.block_side * info_.block_side * info_.block_side;
  Pages pages;
  pages.reserve(count);
  RecordCheck check(place_, section.offset());
  while (pages.size() < count) {
    check.at(section.offset());
    PageEntry entry;
    std::memcpy(&entry, section.ahead(sizeof entry).data(), sizeof entry);
    section.skip(sizeof entry);
    check(entry.codec < kCodecs, "page codec", entry.codec, "0 (raw), 1 (lz4) or 2 (zstd)");
    check(entry.reserved == 0, "page reserved", entry.reserved, "0");
    check(entry.subblocks >= 1 && entry.subblocks <= per_block, "page subblocks", entry.subblocks,
          [&] { return fmt::format("1..{}", per_block); });
    const auto codec = static_cast<Codec>(entry.codec);
    const std::uint64_t unpacked = entry.subblocks * subblock_bytes;
    check(codec == Codec::raw ? entry.bytes == unpacked : entry.bytes > 0 && entry.bytes < unpacked, "page bytes",
          entry.bytes, [&] {
            return codec == Codec::raw ? fmt::format("{}, of {} subblocks", unpacked, entry.subblocks)
                                       : fmt::format("1..{}, packed from {}", unpacked - 1, unpacked);
          });
    pages.push_back({.checksum = entry.checksum,
                     .offset = at.offset,
                     .first_subblock = at.first_subblock,
                     .bytes = entry.bytes,
                     .codec = codec,
                     .subblocks = entry.subblocks});
    at.offset += entry.bytes;
    at.first_subblock += entry.subblocks;
  }
  return pages;
}

std::vector<Page> PageTable::pagesOf(std::uint64_t first, std::uint64_t count) const {
  std::vector<Page> found;
  if (count == 0) return found;
  for (std::size_t i = groupOf(first); i + 1 < groups_.size() && groups_[i].first_subblock < first + count; ++i) {
    if (groups_[i].first_page == groups_[i + 1].first_page) continue;  // of blocks of which only the aprons have voxels
    const std::shared_ptr<const Pages> pages = group(i);
    auto page = std::ranges::upper_bound(*pages, first, {}, &Page::first_subblock);
    if (page != pages->begin()) --page;
    for (; page != pages->end() && page->first_subblock < first + count; ++page) found.push_back(*page);
  }
  return found;
}

std::size_t PageTable::groupOf(std::uint64_t subblock) const {
  const auto end = groups_.end() - 1;
  return static_cast<std::size_t>(
      std::ranges::upper_bound(groups_.begin(), end, subblock, {}, &PageGroup::first_subblock) - groups_.begin() - 1);
}

void PageTable::check(std::span<const Block> blocks) const {
  const RecordCheck check(place_, place_.sections.pages.offset);
  std::size_t number = groups_.size();
  std::shared_ptr<const Pages> pages;
  for (const Block& block : blocks) {
    if (const std::size_t wanted = groupOf(block.first_stored); wanted != number) pages = group(number = wanted);
    const std::uint64_t found =
        std::prev(std::ranges::upper_bound(*pages, block.first_stored, {}, &Page::first_subblock))->first_subblock;
    check(found == block.first_stored, "page's first subblock", found,
          [&] { return fmt::format("its block's, {}", block.first_stored); });
  }
}

std::shared_ptr<const PageTable::Pages> PageTable::group(std::size_t number) const {
  {
    const std::scoped_lock lock(mutex_);
    const auto known = kept_.find(number);
    if (known != kept_.end()) {
      ages_.splice(ages_.begin(), ages_, known->second.age);
      return known->second.pages;
    }
  }
  const PageGroup& begin = groups_[number];
  const PageGroup& end = groups_[number + 1];
  const std::uint64_t count = end.first_page - begin.first_page;
  const std::uint64_t at = place_.sections.pages.offset + begin.first_page * sizeof(PageEntry);
  SectionReader section(read_, at, count * sizeof(PageEntry));
  std::shared_ptr<const Pages> pages;
  withChecksum(place_, "pages", section, begin.checksum, [&] {
    pages = std::make_shared<const Pages>(decode(section, count, begin));
    const Page& last = pages->back();
    const RecordCheck check(place_, at);
    check(last.first_subblock + last.subblocks == end.first_subblock, "subblocks of a group of pages",
          last.first_subblock + last.subblocks, [&] { return fmt::format("up to {}", end.first_subblock); });
    check(last.offset + last.bytes == end.offset, "bytes of a group of pages", last.offset + last.bytes,
          [&] { return fmt::format("up to {}", end.offset); });
  });
  keep(number, pages);
  return pages;
}

void PageTable::keep(std::size_t number, std::shared_ptr<const Pages> pages) const {
  const std::scoped_lock lock(mutex_);
  if (kept_.contains(number)) return;  // another thread was first
  ages_.push_front(number);
  kept_.emplace(number, Kept{.pages = std::move(pages), .age = ages_.begin()});
  if (kept_.size() <= kMostKept) return;
  kept_.erase(ages_.back());
  ages_.pop_back();
}

}  // namespace blockwalk
