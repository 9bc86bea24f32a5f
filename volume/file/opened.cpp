// SPDX-License-Identifier: Apache-2.0
#include "volume/file/opened.h"

#include <algorithm>
#include <utility>

#include "volume/error.h"
#include "volume/file/nonempty_box.h"

namespace blockwalk {

VolumeFile::Opened::Opened(std::shared_ptr<const FileContent> file, std::shared_ptr<const Steps> all_steps, int number)
    : content(std::move(file)), steps(std::move(all_steps)), step(number), name(content->name()) {
  std::uint64_t bytes = content->bytes();
  if (steps != nullptr) {
    const StepPlace& place = steps->places.at(static_cast<std::size_t>(step));
    begin = place.offset;
    bytes = place.bytes;
    name += fmt::format(" step {} (at offset {})", step, begin);
  }
  if (bytes < sizeof(FileHeader)) {
    failData("{}: {} bytes, but the header of a .bwv file alone has {}", name, bytes, sizeof(FileHeader));
  }
  std::vector<std::byte> start(sizeof(FileHeader));
  read(0, start);
  start.resize(headerBytes(start, bytes, name));
  read(sizeof(FileHeader), std::span(start).subspan(sizeof(FileHeader)));
  header = decodeHeader(start, bytes, name);
  pages = std::vector<Lazy<PageTable>>(header.layout.sections.size());
  indices = std::vector<Lazy<RecordIndex>>(header.layout.entries.size());
  groups = std::vector<Lazy<RecordGroups>>(header.layout.entries.size());
  checksums = std::vector<std::array<Lazy<std::vector<std::uint64_t>>, 2>>(header.layout.sections.size());
  if (steps != nullptr) showAllSteps(*steps, header.info, name);
}

RecordPlace VolumeFile::Opened::place(int level, int channel, Form form) const {
  BLOCKWALK_CHECK(header.info.has(level, form), ==, true);
  BLOCKWALK_CHECK(channel, >=, 0);
  BLOCKWALK_CHECK(static_cast<std::size_t>(channel), <, header.info.channels.size());
  const std::size_t entry = entryIndex(header.info, level, form);
  const auto channel_index = static_cast<std::size_t>(channel);
  const char* maxima = form == Form::maxima ? " maxima" : "";
  return {.file = name,
          .name = header.info.channels.size() > 1 ? fmt::format("level {}{} channel {}", level, maxima, channel)
                                                  : fmt::format("level {}{}", level, maxima),
          .entry = header.layout.entries[entry],
          .sections = header.layout.of(entry, channel_index),
          .info = header.info.level(level, form),
          .channel = channel_index};
}

std::vector<RecordPlace> VolumeFile::Opened::channelPlaces(int level, Form form) const {
  std::vector<RecordPlace> places;
  for (int channel = 0; channel < static_cast<int>(header.info.channels.size()); ++channel) {
    places.push_back(place(level, channel, form));
  }
  return places;
}

const RecordIndex* VolumeFile::Opened::indexOf(const RecordPlace& at) const {
  const std::size_t entry = entryOf(at);
  const Section& section = header.layout.indices[entry];
  if (section.bytes == 0) return nullptr;
  return &indices[entry].get([&] {
    const EntryPlace level = entryPlace(entry, header.info.levels.size());
    const std::vector<RecordPlace> channels = channelPlaces(level.level, level.form);
    return std::make_unique<RecordIndex>(readIndex(channels, header.info, section, readBytes()));
  });
}

const RecordGroups& VolumeFile::Opened::groupsOf(const RecordPlace& at) const {
  if (const RecordIndex* index = indexOf(at)) return index->records;
  return groups[entryOf(at)].get([&] { return std::make_unique<RecordGroups>(at, header.info, readBytes()); });
}

const std::vector<std::uint64_t>& VolumeFile::Opened::rangeChecksumsOf(const RecordPlace& at, Extent extent) const {
  if (const RecordIndex* index = indexOf(at)) return index->channels[at.channel].of(extent);
  const RecordGroups& records = groupsOf(at);
  return checksums[sectionsOf(at)][static_cast<std::size_t>(extent)].get([&] {
    return std::make_unique<std::vector<std::uint64_t>>(records.rangeChecksums(at, header.info, extent, readBytes()));
  });
}

const PageTable& VolumeFile::Opened::pagesOf(const RecordPlace& at) const {
  return pages[sectionsOf(at)].get([&] {
    const RecordIndex* index = indexOf(at);
    if (index == nullptr) return std::make_unique<PageTable>(at, header.info, readBytes());
    return std::make_unique<PageTable>(at, header.info, readBytes(), index->channels[at.channel].pages);
  });
}

// Of a file that has not too many for it; of others they are first looked at when voxels are read.
void VolumeFile::Opened::countPages() {
  std::uint64_t count = 0;
  for (const ChannelSections& sections : header.layout.sections) count += sections.pages.bytes / sizeof(PageEntry);
  if (count > kMostCountedPages) return;
  for (std::size_t i = 0; i < header.layout.entries.size(); ++i) {
    const EntryPlace entry = entryPlace(i, header.info.levels.size());
    for (int channel = 0; channel < static_cast<int>(header.info.channels.size()); ++channel) {
      const RecordPlace at = place(entry.level, channel, entry.form);
      const PageTable& table =
          pages[sectionsOf(at)].get([&] { return std::make_unique<PageTable>(at, header.info, readBytes()); });
      for (std::size_t codec = 0; codec < kCodecs; ++codec) header.info.pages[codec] += table.byCodec()[codec];
    }
  }
}

VoxelBox VolumeFile::Opened::nonemptyBox(std::uint64_t most_bytes) const {
  const EntryPlace entry = boxEntry(header, most_bytes);
  return boxOfRecords(place(entry.level, 0, entry.form), entry.level, header.info, readBytes());
}

Level VolumeFile::Opened::readRecords(const RecordPlace& at, Extent extent, const BlockWindow& window) const {
  content->checkLength();
  Level level = isWhole(at, window) ? readWhole(at, extent) : readWindow(at, extent, window);
  if (extent == Extent::stored) pagesOf(at).check(level.blocks);
  return level;
}

Level VolumeFile::Opened::readWhole(const RecordPlace& at, Extent extent) const {
  const ReadBytes reads = readBytes();
  const Section& of_ranges = rangeSection(at, extent);
  SectionReader blocks(reads, at.entry.blocks.offset, at.entry.blocks.bytes);
  SectionReader ranges(reads, of_ranges.offset, of_ranges.bytes);
  LevelDecoder decoder(at, extent, {},
                       {.records = at.entry.apron_block_count,
                        .blocks = at.entry.block_count,
                        .stored = at.entry.subblock_count,
                        .all = at.entry.apron_subblock_count});
  withChecksum(at, "block records", blocks, at.entry.blocks.checksum, [&] {
    withChecksum(at, extent == Extent::stored ? "ranges" : "apron ranges", ranges, of_ranges.checksum, [&] {
      RecordReader record_reader(at, header.info, blocks);
      RangeReader range_reader(at, header.info, extent, ranges);
      decoder.add(record_reader, range_reader);
    });
  });
  return decoder.take();
}

// Where groups that are read end the next one's code says so: it is looked at too.
template <typename Visit>
void VolumeFile::Opened::forEachGroup(const RecordPlace& at, std::span<const std::size_t> met, Visit visit) const {
  const ReadBytes reads = readBytes();
  const RecordGroups& records = groupsOf(at);
  for (std::size_t i = 0; i < met.size(); ++i) {
    const std::size_t group = met[i];
    const RecordGroup& next = records[group + 1];
    SectionReader blocks(reads, records[group].offset, next.offset - records[group].offset);
    withChecksum(at, "block records", blocks, records[group].checksum, [&] {
      RecordReader reader(at, header.info, blocks, records[group], next);
      visit(reader, group);
    });
    const bool is_behind = group + 1 < records.size() && (i + 1 == met.size() || met[i + 1] != group + 1);
    if (is_behind) checkFirstRecord(at, next);
  }
}

void VolumeFile::Opened::checkFirstRecord(const RecordPlace& at, const RecordGroup& group) const {
  const std::uint64_t left = at.entry.blocks.offset + at.entry.blocks.bytes - group.offset;
  std::vector<std::byte> bytes(std::min<std::uint64_t>(largestBlockRecordBytes(header.info.block_side), left));
  read(group.offset, bytes);
  std::span<const std::byte> ahead(bytes);
  BlockRecord record;
  const RecordCheck check(at, group.offset);
  check(takeBlockRecord(ahead, header.info.block_side, record), "block", left,
        "bytes of an origin and two ascending sets of subblocks, not both empty");
  const std::uint64_t code = mortonCode(glm::uvec3(record.origin));
  check(code == group.first_code, "Morton code of the origin", code,
        [&] { return fmt::format("{}, its group's first", group.first_code); });
}

Level VolumeFile::Opened::readWindow(const RecordPlace& at, Extent extent, const BlockWindow& window) const {
  const ReadBytes reads = readBytes();
  const RecordGroups& records = groupsOf(at);
  const std::vector<std::uint64_t>& range_checksums = rangeChecksumsOf(at, extent);
  const char* const what = extent == Extent::stored ? "ranges" : "apron ranges";
  const std::vector<std::size_t> met = records.meeting(window);
  LevelDecoder decoder(at, extent, window, records.countsOf(met));
  forEachGroup(at, met, [&](RecordReader& reader, std::size_t group) {
    const std::uint64_t from = records.rangeOffset(at, header.info, extent, group);
    const std::uint64_t to = records.rangeOffset(at, header.info, extent, group + 1);
    SectionReader ranges(reads, from, to - from);
    withChecksum(at, what, ranges, range_checksums[group], [&] {
      RangeReader range_reader(at, header.info, extent, ranges);
      decoder.add(reader, range_reader);
    });
  });
  return decoder.take();
}

RecordCount VolumeFile::Opened::mostRecords(const RecordPlace& at, Extent extent, const BlockWindow& window) const {
  const bool is_stored = extent == Extent::stored;
  if (isWhole(at, window)) {
    return {.blocks = is_stored ? at.entry.block_count : at.entry.apron_block_count,
            .subblocks = is_stored ? at.entry.subblock_count : at.entry.apron_subblock_count};
  }
  content->checkLength();
  const RecordGroups& records = groupsOf(at);
  const RecordCounts most = records.countsOf(records.meeting(window));
  return {.blocks = is_stored ? most.blocks : most.records, .subblocks = is_stored ? most.stored : most.all};
}

RecordCount VolumeFile::Opened::countRecords(const RecordPlace& at, Extent extent, const BlockWindow& window) const {
  content->checkLength();
  RecordCount count;
  forEachGroup(at, groupsOf(at).meeting(window), [&](RecordReader& reader, std::size_t) {
    BlockRecord record;
    while (reader.next(record)) {
      const int subblocks = countOf(record.stored) + (extent == Extent::apron ? countOf(record.beyond) : 0);
      if (subblocks == 0 || !window.contains(record.origin)) continue;
      ++count.blocks;
      count.subblocks += static_cast<std::uint64_t>(subblocks);
    }
  });
  return count;
}

}  // namespace blockwalk
