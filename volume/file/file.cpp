// SPDX-License-Identifier: Apache-2.0
#include "volume/file/file.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "volume/codec_name.h"
#include "volume/error.h"
#include "volume/file/checksum.h"
#include "volume/file/codec.h"
#include "volume/file/file_content.h"
#include "volume/file/header.h"
#include "volume/file/lazy.h"
#include "volume/file/nonempty_box.h"
#include "volume/file/page_table.h"
#include "volume/file/record_index.h"
#include "volume/file/records.h"
#include "volume/file/steps.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kRunBytes = std::uint64_t{1} << 18;  // of pages read at once, or a single page

// Null where the file is one volume.
std::shared_ptr<const Steps> readSteps(const FileContent& content) {
  std::vector<std::byte> start(std::min<std::uint64_t>(sizeof(StepsHeader), content.bytes()));
  content.read(0, start);
  if (!beginsSteps(start)) return nullptr;
  start.resize(stepsHeaderBytes(start, content.bytes(), content.name()));
  content.read(0, start);
  return std::make_shared<const Steps>(decodeSteps(start, content.bytes(), content.name()));
}

}  // namespace

// The volume of one step of the open file; most files have but one.
struct VolumeFile::Opened {
  Opened(std::shared_ptr<const FileContent> file, std::shared_ptr<const Steps> all_steps, int number);

  // Fills `out` from `offset` of the volume on. Throws as FileContent does.
  void read(std::uint64_t offset, std::span<std::byte> out) const {
    content->read(begin + offset, out);
    bytes_read += out.size();
  }
  RecordPlace place(int level, int channel, Form form) const;
  std::vector<RecordPlace> channelPlaces(int level, Form form) const;
  std::size_t entryOf(const RecordPlace& at) const {
    return static_cast<std::size_t>(&at.entry - header.layout.entries.data());
  }
  std::size_t sectionsOf(const RecordPlace& at) const {
    return static_cast<std::size_t>(&at.sections - header.layout.sections.data());
  }
  // Of the level; null where the file has none.
  const RecordIndex* indexOf(const RecordPlace& at) const;
  // From the index where there is one, else from all records.
  const RecordGroups& groupsOf(const RecordPlace& at) const;
  const std::vector<std::uint64_t>& rangeChecksumsOf(const RecordPlace& at, Extent extent) const;
  const PageTable& pagesOf(const RecordPlace& at) const;
  ReadBytes readBytes() const {
    return [this](std::uint64_t offset, std::span<std::byte> out) { read(offset, out); };
  }
  void countPages();
  VoxelBox nonemptyBox(std::uint64_t most_bytes) const;
  Level readRecords(const RecordPlace& at, Extent extent, const BlockWindow& window) const;
  Level readWhole(const RecordPlace& at, Extent extent) const;
  Level readWindow(const RecordPlace& at, Extent extent, const BlockWindow& window) const;
  bool isWhole(const RecordPlace& at, const BlockWindow& window) const {
    return window.holds(latticeDims(at.info.dims, header.info.blockVoxels()));
  }
  RecordCount mostRecords(const RecordPlace& at, Extent extent, const BlockWindow& window) const;
  RecordCount countRecords(const RecordPlace& at, Extent extent, const BlockWindow& window) const;

  std::shared_ptr<const FileContent> content;
  std::shared_ptr<const Steps> steps;  // null: the file is one volume
  int step = 0;
  std::string name;         // for messages
  std::uint64_t begin = 0;  // of the volume in the file
  DecodedHeader header;
  std::vector<Lazy<PageTable>> pages;      // as the layout's sections
  std::vector<Lazy<RecordIndex>> indices;  // as the layout's entries
  std::vector<Lazy<RecordGroups>> groups;  // as those, of levels that have no index
  std::vector<std::array<Lazy<std::vector<std::uint64_t>>, 2>>
      checksums;  // of groups of ranges, by Extent; as sections
  mutable std::atomic<std::uint64_t> bytes_read = 0;
};

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

Level VolumeFile::Opened::readWindow(const RecordPlace& at, Extent extent, const BlockWindow& window) const {
  const ReadBytes reads = readBytes();
  const RecordGroups& records = groupsOf(at);
  const std::vector<std::uint64_t>& range_checksums = rangeChecksumsOf(at, extent);
  const char* const what = extent == Extent::stored ? "ranges" : "apron ranges";
  const std::vector<std::size_t> met = records.meeting(window);
  LevelDecoder decoder(at, extent, window, records.countsOf(met));
  for (const std::size_t group : met) {
    const std::uint64_t from = records.rangeOffset(at, header.info, extent, group);
    const std::uint64_t to = records.rangeOffset(at, header.info, extent, group + 1);
    SectionReader blocks(reads, records[group].offset, records[group + 1].offset - records[group].offset);
    SectionReader ranges(reads, from, to - from);
    withChecksum(at, "block records", blocks, records[group].checksum, [&] {
      withChecksum(at, what, ranges, range_checksums[group], [&] {
        RecordReader record_reader(at, header.info, blocks, records[group], records[group + 1]);
        RangeReader range_reader(at, header.info, extent, ranges);
        decoder.add(record_reader, range_reader);
      });
    });
  }
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
  const ReadBytes reads = readBytes();
  const RecordGroups& records = groupsOf(at);
  RecordCount count;
  for (const std::size_t group : records.meeting(window)) {
    SectionReader blocks(reads, records[group].offset, records[group + 1].offset - records[group].offset);
    withChecksum(at, "block records", blocks, records[group].checksum, [&] {
      RecordReader record_reader(at, header.info, blocks, records[group], records[group + 1]);
      BlockRecord record;
      while (record_reader.next(record)) {
        const int subblocks = countOf(record.stored) + (extent == Extent::apron ? countOf(record.beyond) : 0);
        if (subblocks == 0 || !window.contains(record.origin)) continue;
        ++count.blocks;
        count.subblocks += static_cast<std::uint64_t>(subblocks);
      }
    });
  }
  return count;
}

VolumeFile::VolumeFile(const std::filesystem::path& path) {
  auto content = std::make_shared<const FileContent>(path);
  auto steps = readSteps(*content);
  opened_ = std::make_unique<Opened>(std::move(content), std::move(steps), 0);
  opened_->countPages();
  opened_->header.info.nonempty = boxOfSteps();
}

// A broken step, or a broken level, is told to who reads it; until then the box is the whole.
VoxelBox VolumeFile::boxOfSteps() const {
  const int steps = info().steps;
  const int looked_at = std::min(steps, kMostBoxSteps);
  const std::uint64_t most_bytes = kBoxRecordBytes / static_cast<std::uint64_t>(looked_at);
  try {
    VoxelBox box = opened_->nonemptyBox(most_bytes);
    for (int i = 1; i < looked_at; ++i) {
      const int step = static_cast<int>(std::int64_t{i} * (steps - 1) / (looked_at - 1));
      box.include(Opened(opened_->content, opened_->steps, step).nonemptyBox(most_bytes));
    }
    const bool is_inside = glm::all(glm::lessThanEqual(box.end, info().dims));  // another grid is another fault
    if (is_inside) return box;
  } catch (const DataError&) {
  }
  return {.end = info().dims};
}
VolumeFile::VolumeFile(std::unique_ptr<Opened> opened) : opened_(std::move(opened)) {}
VolumeFile::~VolumeFile() = default;
VolumeFile::VolumeFile(VolumeFile&&) noexcept = default;
VolumeFile& VolumeFile::operator=(VolumeFile&&) noexcept = default;

const VolumeInfo& VolumeFile::info() const { return opened_->header.info; }
const std::filesystem::path& VolumeFile::path() const { return opened_->content->path(); }
std::uint64_t VolumeFile::fileBytes() const { return opened_->content->bytes(); }
int VolumeFile::step() const { return opened_->step; }
VolumeFile VolumeFile::atStep(int step) const {
  BLOCKWALK_CHECK(step, >=, 0);
  BLOCKWALK_CHECK(step, <, info().steps);
  auto other = std::make_unique<Opened>(opened_->content, opened_->steps, step);
  other->countPages();
  const VolumeInfo& own = info();
  const VolumeInfo& found = other->header.info;
  bool is_same = found.dims == own.dims && areOnePlace(own.world_from_index, found.world_from_index, own.dims) &&
                 found.subblock_side == own.subblock_side && found.block_side == own.block_side &&
                 found.maxima.size() == own.maxima.size();
  for (std::size_t i = 0; i < own.channels.size(); ++i) {
    is_same = is_same && found.channels[i].values == own.channels[i].values;
  }
  if (!is_same) failData("{}: is another grid than the first step's, or holds labels where that does not", other->name);
  other->header.info.nonempty = own.nonempty;
  return VolumeFile(std::move(other));
}

std::uint64_t VolumeFile::bytesRead() const { return opened_->bytes_read; }

Level VolumeFile::readLevel(int level, int channel, Form form, const BlockWindow& window) const {
  return opened_->readRecords(opened_->place(level, channel, form), Extent::stored, window);
}

Level VolumeFile::readApronLevel(int level, int channel, Form form, const BlockWindow& window) const {
  return opened_->readRecords(opened_->place(level, channel, form), Extent::apron, window);
}

RecordCount VolumeFile::mostRecords(int level, Form form, bool with_apron, const BlockWindow& window) const {
  return opened_->mostRecords(opened_->place(level, 0, form), with_apron ? Extent::apron : Extent::stored, window);
}

RecordCount VolumeFile::countRecords(int level, Form form, bool with_apron, const BlockWindow& window) const {
  return opened_->countRecords(opened_->place(level, 0, form), with_apron ? Extent::apron : Extent::stored, window);
}

void VolumeFile::checkIndex(int level, Form form) const {
  const std::vector<RecordPlace> channels = opened_->channelPlaces(level, form);
  const RecordPlace& place = channels.front();
  const RecordIndex* index = opened_->indexOf(place);
  if (index == nullptr) return;
  const RecordIndex found = findIndex(channels, info(), opened_->readBytes());
  if (encodeIndex(found, channels) == encodeIndex(*index, channels)) return;
  failData("{}: {} index at offset {}, {} bytes: is not that of the level's records", opened_->name, place.name,
           opened_->header.layout.indices[opened_->entryOf(place)].offset,
           opened_->header.layout.indices[opened_->entryOf(place)].bytes);
}

void VolumeFile::readVoxels(int level, int channel, std::uint64_t first, std::uint64_t count, std::span<std::byte> out,
                            Form form) const {
  const RecordPlace place = opened_->place(level, channel, form);
  BLOCKWALK_CHECK(first, <=, place.entry.subblock_count);
  BLOCKWALK_CHECK(count, <=, place.entry.subblock_count - first);
  const std::uint64_t subblock_bytes = info().subblockVoxels() * voxelBytes(info().type);
  BLOCKWALK_CHECK(out.size(), ==, count * subblock_bytes);
  if (count == 0) return;

  opened_->content->checkLength();
  const std::vector<Page> pages = opened_->pagesOf(place).pagesOf(first, count);
  const std::uint64_t begin = first * subblock_bytes;
  const std::uint64_t end = begin + out.size();
  // `out` may be device memory, which is slow to read: what is checked is a copy of a run of pages that stays in the
  // cache. What is packed is unpacked there, whole, and what is asked for of it copied.
  std::vector<std::byte> run;
  std::vector<std::byte> unpacked;
  for (auto page = pages.begin(); page != pages.end();) {
    auto run_end = page;
    std::uint64_t run_bytes = 0;
    do {
      run_bytes += run_end++->bytes;
    } while (run_end != pages.end() && run_bytes < kRunBytes);
    run.resize(run_bytes);
    opened_->read(page->offset, run);
    for (std::span<const std::byte> left = run; page != run_end; ++page) {
      const std::span<const std::byte> bytes = left.first(page->bytes);
      left = left.subspan(page->bytes);
      const std::uint64_t found = checksumOf(bytes);
      if (found != page->checksum) {
        failData("{}: {} voxels at offset {}, {} bytes: checksum is {:016x}, must be {:016x}", opened_->name,
                 place.name, page->offset, page->bytes, found, page->checksum);
      }
      std::span<const std::byte> voxels = bytes;
      if (page->codec != Codec::raw) {
        unpacked.resize(page->subblocks * subblock_bytes);  // each byte of it is written, or the page refused
        if (!unpackPage(page->codec, bytes, unpacked)) {
          failData("{}: {} voxels at offset {}, {} bytes: do not unpack as {} to {} bytes", opened_->name, place.name,
                   page->offset, page->bytes, codecName(page->codec), unpacked.size());
        }
        voxels = unpacked;
      }
      const std::uint64_t page_begin = page->first_subblock * subblock_bytes;
      const std::uint64_t from = std::max(begin, page_begin);
      const std::uint64_t to = std::min(end, page_begin + voxels.size());
      std::memcpy(out.data() + (from - begin), voxels.data() + (from - page_begin), to - from);
    }
  }
}

void VolumeFile::expectVoxels(int level, int channel, std::uint64_t first, std::uint64_t count, Form form) const {
  for (const Page& page : opened_->pagesOf(opened_->place(level, channel, form)).pagesOf(first, count)) {
    opened_->content->expect(opened_->begin + page.offset, page.bytes);
  }
}

}  // namespace blockwalk
