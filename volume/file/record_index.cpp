// SPDX-License-Identifier: Apache-2.0
#include "volume/file/record_index.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "volume/file/checksum.h"
#include "volume/file/plain_bytes.h"

namespace blockwalk {
namespace {

// Where the pages of each group lie, and the end.
std::vector<PageGroup> findPages(const RecordPlace& place, const RecordGroups& records, const ReadBytes& read) {
  const Section& pages = place.sections.pages;
  SectionReader section(read, pages.offset, pages.bytes);
  std::vector<PageGroup> groups;
  withChecksum(place, "pages", section, pages.checksum, [&] {
    std::uint64_t offset = place.sections.voxels.offset;
    for (std::size_t i = 0; i <= records.size(); ++i) {
      const RecordCounts& before = records[i].before;
      PageGroup group{.first_page = before.blocks, .first_subblock = before.stored, .offset = offset};
      if (i < records.size()) {
        const std::uint64_t count = records[i + 1].before.blocks - before.blocks;
        const std::span<const std::byte> entries = section.ahead(count * sizeof(PageEntry));
        group.checksum = checksumOf(entries);
        for (const std::byte* at = entries.data(); at != entries.data() + entries.size();) {
          offset += takePlain<PageEntry>(at).bytes;
        }
        section.skip(entries.size());
      }
      groups.push_back(group);
    }
  });
  return groups;
}

// Holds a group against the next, or the end: what it has, as the difference of the two says.
class GroupCheck {
 public:
  GroupCheck(const RecordPlace& place, const VolumeInfo& info)
      : largest_record_(largestBlockRecordBytes(info.block_side)),
        per_block_(static_cast<std::uint64_t>(info.block_side * info.block_side * info.block_side)),
        check_(place, 0, "index") {}

  void operator()(std::uint64_t offset, const RecordGroup& group, const RecordGroup& next) {
    check_.at(offset);
    const std::uint64_t records = next.before.records - group.before.records;
    check_(group.first_code < next.first_code, "first code", group.first_code,
           [&] { return fmt::format("below {}, the next group's", next.first_code); });
    isWithin("bytes of block records", next.offset - group.offset, records * kLeastBlockRecordBytes,
             records * largest_record_);
    const std::uint64_t blocks = next.before.blocks - group.before.blocks;
    isWithin("blocks", blocks, 0, records);
    const std::uint64_t stored = next.before.stored - group.before.stored;
    isWithin("stored subblocks", stored, blocks, blocks * per_block_);
    isWithin("subblocks", next.before.all - group.before.all, std::max(records, stored), records * per_block_);
  }
  void operator()(std::uint64_t offset, const PageGroup& group, const PageGroup& next, std::uint64_t largest_page) {
    check_.at(offset);
    const std::uint64_t pages = next.first_page - group.first_page;
    isWithin("bytes of pages", next.offset - group.offset, pages, pages * largest_page);
  }

 private:
  void isWithin(std::string_view field, std::uint64_t value, std::uint64_t least, std::uint64_t most) const {
    check_(value >= least && value <= most, field, value, [&] { return fmt::format("{}..{}", least, most); });
  }

  std::uint64_t largest_record_;
  std::uint64_t per_block_;
  RecordCheck check_;
};

}  // namespace

RecordIndex findIndex(std::span<const RecordPlace> channels, const VolumeInfo& info, const ReadBytes& read) {
  RecordIndex index{.records = RecordGroups(channels.front(), info, read), .channels = {}};
  for (const RecordPlace& place : channels) {
    index.channels.push_back({.ranges = index.records.rangeChecksums(place, info, Extent::stored, read),
                              .apron_ranges = index.records.rangeChecksums(place, info, Extent::apron, read),
                              .pages = findPages(place, index.records, read)});
  }
  return index;
}

std::vector<std::byte> encodeIndex(const RecordIndex& index, std::span<const RecordPlace> channels) {
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i < index.records.size(); ++i) {
    const RecordGroup& group = index.records[i];
    appendPlain(bytes, IndexGroup{.first_code = group.first_code,
                                  .offset = group.offset - channels.front().entry.blocks.offset,
                                  .checksum = group.checksum,
                                  .blocks = group.before.blocks,
                                  .stored = group.before.stored,
                                  .all = group.before.all});
    for (std::size_t channel = 0; channel < channels.size(); ++channel) {
      const ChannelGroups& groups = index.channels[channel];
      appendPlain(bytes, IndexPart{.ranges = groups.ranges[i],
                                   .apron_ranges = groups.apron_ranges[i],
                                   .pages = groups.pages[i].checksum,
                                   .page_offset = groups.pages[i].offset - channels[channel].sections.voxels.offset});
    }
  }
  appendPlain(bytes, checksumOf(bytes));
  return bytes;
}

RecordIndex readIndex(std::span<const RecordPlace> channels, const VolumeInfo& info, const Section& section,
                      const ReadBytes& read) {
  const RecordPlace& place = channels.front();
  const LevelEntry& entry = place.entry;
  std::vector<std::byte> bytes(section.bytes);
  read(section.offset, bytes);
  const std::uint64_t all = bytes.size() - sizeof(std::uint64_t);
  const std::uint64_t found = checksumOf(std::span(bytes).first(all));
  const std::byte* last = bytes.data() + all;
  if (const auto wanted = takePlain<std::uint64_t>(last); found != wanted) {
    failData("{}: {} index at offset {}, {} bytes: checksum is {:016x}, must be {:016x}", place.file, place.name,
             section.offset, section.bytes, found, wanted);
  }
  const std::size_t group_bytes = sizeof(IndexGroup) + channels.size() * sizeof(IndexPart);
  const std::size_t count = all / group_bytes;

  const std::byte* next = bytes.data();
  std::vector<RecordGroup> records(count + 1);
  std::vector<ChannelGroups> parts(channels.size());
  for (std::size_t i = 0; i < count; ++i) {
    const auto group = takePlain<IndexGroup>(next);
    records[i] = {
        .first_code = group.first_code,
        .offset = entry.blocks.offset + group.offset,
        .checksum = group.checksum,
        .before = {.records = i * kGroupRecords, .blocks = group.blocks, .stored = group.stored, .all = group.all}};
    for (std::size_t channel = 0; channel < channels.size(); ++channel) {
      const auto part = takePlain<IndexPart>(next);
      parts[channel].ranges.push_back(part.ranges);
      parts[channel].apron_ranges.push_back(part.apron_ranges);
      parts[channel].pages.push_back({.first_page = group.blocks,
                                      .first_subblock = group.stored,
                                      .offset = channels[channel].sections.voxels.offset + part.page_offset,
                                      .checksum = part.pages});
    }
  }
  records.back() = {.first_code = kNoCode,
                    .offset = entry.blocks.offset + entry.blocks.bytes,
                    .checksum = 0,
                    .before = {.records = entry.apron_block_count,
                               .blocks = entry.block_count,
                               .stored = entry.subblock_count,
                               .all = entry.apron_subblock_count}};
  const RecordCheck first(place, section.offset, "index");
  const auto isFirst = [&](std::string_view field, std::uint64_t value) {
    first(value == 0, field, value, "0 of the first");
  };
  isFirst("offset", records[0].offset - entry.blocks.offset);
  isFirst("blocks before", records[0].before.blocks);
  isFirst("stored subblocks before", records[0].before.stored);
  isFirst("subblocks before", records[0].before.all);
  GroupCheck check(place, info);
  for (std::size_t i = 0; i < count; ++i) check(section.offset + i * group_bytes, records[i], records[i + 1]);
  const std::uint64_t largest_page = static_cast<std::uint64_t>(info.block_side * info.block_side * info.block_side) *
                                     info.subblockVoxels() * voxelBytes(info.type);
  for (std::size_t channel = 0; channel < channels.size(); ++channel) {
    const Section& voxels = channels[channel].sections.voxels;
    std::vector<PageGroup>& pages = parts[channel].pages;
    isFirst("page offset", pages[0].offset - voxels.offset);
    pages.push_back({.first_page = entry.block_count,
                     .first_subblock = entry.subblock_count,
                     .offset = voxels.offset + voxels.bytes});
    for (std::size_t i = 0; i < count; ++i) {
      check(section.offset + i * group_bytes, pages[i], pages[i + 1], largest_page);
    }
  }
  return {.records = RecordGroups(place, info, std::move(records)), .channels = std::move(parts)};
}

}  // namespace blockwalk
