// SPDX-License-Identifier: Apache-2.0
#include "volume/build/write.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "volume/error.h"
#include "volume/file/checksum.h"
#include "volume/file/codec.h"
#include "volume/file/header.h"
#include "volume/file/metadata.h"
#include "volume/file/record_index.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kPartBytes = std::uint64_t{1} << 20;   // copied at once; a page may be longer
constexpr std::uint64_t kSyncBytes = std::uint64_t{64} << 20;  // written until the disk is told to begin

// With the voxels as long as they are unpacked.
FileSizes sizesOf(const VolumeInfo& info, const BuiltLevels& built, const std::string& metadata) {
  FileSizes sizes{.blocks = {}, .voxels = {}, .metadata = metadata.size()};
  for (const auto* levels : {&built.levels, &built.maxima}) {
    for (const BuiltLevel& level : *levels) {
      sizes.blocks.push_back(level.blocks.size());
      sizes.voxels.insert(sizes.voxels.end(), info.channels.size(), level.info.voxel_bytes);
    }
  }
  const auto isLarge = [](const BuiltLevel& level) { return level.info.apron_block_count > kGroupRecords; };
  if (std::ranges::any_of(built.levels, isLarge) || std::ranges::any_of(built.maxima, isLarge)) {
    sizes.group_records = kGroupRecords;
  }
  return sizes;
}

// Pages as the file holds them, one after the other.
struct PackedPages {
  std::vector<std::byte> bytes;
  std::vector<PageEntry> entries;
};

// Packs pages of `counts` subblocks each.
PackedPages packPages(std::vector<std::byte> voxels, std::span<const std::uint8_t> counts, std::size_t subblock_bytes,
                      Codec codec) {
  PackedPages packed;
  PagePacker packer(codec);
  std::size_t done = 0;
  for (const std::uint8_t count : counts) {
    const std::span<const std::byte> page = std::span(voxels).subspan(done, count * subblock_bytes);
    done += page.size();
    PageEntry entry{.bytes = static_cast<std::uint32_t>(page.size()), .subblocks = count};
    if (codec == Codec::raw) {
      entry.checksum = checksumOf(page);
    } else {
      const std::size_t begin = packed.bytes.size();
      entry.codec = static_cast<std::uint8_t>(packer.append(page, packed.bytes));
      const std::span<const std::byte> stored = std::span(packed.bytes).subspan(begin);
      entry.bytes = static_cast<std::uint32_t>(stored.size());
      entry.checksum = checksumOf(stored);
    }
    packed.entries.push_back(entry);
  }
  if (codec == Codec::raw) packed.bytes = std::move(voxels);
  return packed;
}

// Writes every record to its place, which their sizes give, and the voxels behind them as they come.
class VolumeWriter {
 public:
  VolumeWriter(OutputFile& file, std::uint64_t begin, VolumeInfo info, const BuiltLevels& built, const Spill& spill,
               const BuildOptions& options, Workers& workers)
      : file_(file),
        begin_(begin),
        info_(std::move(info)),
        built_(built),
        spill_(spill),
        options_(options),
        name_(file.path().string()),
        metadata_(encodeMetadata(info_, name_)),
        layout_(layOutFile(info_, sizesOf(info_, built, metadata_))),
        part_(kPartBytes),
        channel_bytes_(static_cast<std::size_t>(info_.subblockVoxels()) * voxelBytes(info_.type)),
        workers_(workers),
        syncs_(workers) {
    for (const LevelEntry& entry : layout_.entries) subblocks_ += entry.subblock_count * info_.channels.size();
    voxels_end_ = layout_.of(fileOrder(info_).front(), 0).voxels.offset;
    // A disk that cannot hold a file this long says so now.
    if (options.codec == Codec::raw) file_.setLength(begin_ + layout_.file_bytes);
  }

  void writeEntry(std::size_t index) {
    const std::size_t levels = built_.levels.size();
    const BuiltLevel& level = index < levels ? built_.levels[index] : built_.maxima[index - levels];
    copyRecords(level.blocks, layout_.entries[index].blocks);
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      ChannelSections& sections = layout_.of(index, channel);
      copyRecords(level.channels[channel].ranges, sections.ranges);
      copyRecords(level.channels[channel].apron_ranges, sections.apron_ranges);
      if (index > 0) {
        const TempBytes& voxels = level.channels[channel].voxels;
        writePages(level, sections, [&](std::uint64_t at, std::span<std::byte> out) { voxels.read(at, out); });
        continue;
      }
      const SlotPart part{.slot_bytes = channel_bytes_ * info_.channels.size(),
                          .offset = channel * channel_bytes_,
                          .bytes = channel_bytes_};
      writePages(level, sections, [&, part](std::uint64_t at, std::span<std::byte> out) {
        std::vector<std::uint64_t> slots(out.size() / channel_bytes_);
        level.slots.read(at / channel_bytes_ * sizeof(std::uint64_t), std::as_writable_bytes(std::span(slots)));
        loadSlots(spill_, built_.constants, slots, part, out);
      });
    }
    if (layout_.indices[index].bytes > 0) writeIndex(level, index);
  }

  BuildReport finish() {
    while (!syncs_.empty()) syncs_.take();
    layout_.file_bytes = voxels_end_;
    file_.setLength(begin_ + layout_.file_bytes);
    const std::vector<std::byte> header = encodeHeader(info_, layout_, metadata_);
    decodeHeader(header, layout_.file_bytes, file_.path().string());  // what a reader would refuse gets no name
    write(0, header);
    BuildReport report{.info = info_, .file_bytes = layout_.file_bytes};
    for (std::size_t i = 0; i < layout_.sections.size(); ++i) {
      const ChannelSections& sections = layout_.sections[i];
      if (i < layout_.channels) {
        report.level0_voxel_bytes += sections.voxels.bytes;
      } else {
        report.coarser_level_bytes +=
            sections.ranges.bytes + sections.apron_ranges.bytes + sections.pages.bytes + sections.voxels.bytes;
      }
    }
    for (std::size_t i = 1; i < layout_.entries.size(); ++i) {
      report.coarser_level_bytes += layout_.entries[i].blocks.bytes + layout_.indices[i].bytes;
    }
    report.overhead_bytes = report.file_bytes - report.level0_voxel_bytes - report.coarser_level_bytes;
    return report;
  }

 private:
  // `read(at, out)` fills `out` with the unpacked bytes of the section from `at` on, whole subblocks; from several
  // threads at a time.
  template <typename Read>
  void writePages(const BuiltLevel& level, ChannelSections& sections, Read read) {
    std::vector<std::uint8_t> counts(static_cast<std::size_t>(level.counts.size()));
    level.counts.read(0, std::as_writable_bytes(std::span(counts)));
    sections.voxels = placeSection(voxels_end_, 0);
    std::vector<PageEntry> pages;
    JobsInOrder<PackedPages> jobs(workers_);
    std::uint64_t at = 0;
    for (std::size_t begin = 0; begin < counts.size() || !jobs.empty();) {
      if (begin == counts.size() || jobs.full()) {
        PackedPages packed = jobs.take();
        append(sections.voxels, packed, pages);
        spare_ = std::move(packed.bytes);
        continue;
      }
      std::size_t end = begin;
      std::size_t bytes = 0;
      do {
        bytes += counts[end++] * channel_bytes_;
      } while (end < counts.size() && bytes + counts[end] * channel_bytes_ <= kPartBytes);
      jobs.start([this, &read, at, bytes, run = std::span(counts).subspan(begin, end - begin),
                  voxels = std::exchange(spare_, {})]() mutable {
        voxels.resize(bytes);
        read(at, voxels);
        return packPages(std::move(voxels), run, channel_bytes_, options_.codec);
      });
      at += bytes;
      begin = end;
    }
    voxels_end_ = sections.voxels.offset + sections.voxels.bytes;
    const auto page_bytes = std::as_bytes(std::span(pages));
    BLOCKWALK_CHECK(page_bytes.size(), ==, sections.pages.bytes);
    write(sections.pages.offset, page_bytes);
    sections.pages.checksum = checksumOf(page_bytes);
  }

  // As whoever reads the records finds it.
  void writeIndex(const BuiltLevel& level, std::size_t index) {
    std::vector<RecordPlace> channels;
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      channels.push_back({.file = name_,
                          .name = {},
                          .entry = layout_.entries[index],
                          .sections = layout_.of(index, channel),
                          .info = level.info,
                          .channel = channel});
    }
    const ReadBytes read = [this](std::uint64_t at, std::span<std::byte> out) { file_.read(begin_ + at, out); };
    const std::vector<std::byte> bytes = encodeIndex(findIndex(channels, info_, read), channels);
    BLOCKWALK_CHECK(bytes.size(), ==, layout_.indices[index].bytes);
    write(layout_.indices[index].offset, bytes);
  }

  void append(Section& voxels, const PackedPages& packed, std::vector<PageEntry>& pages) {
    write(voxels.offset + voxels.bytes, packed.bytes);
    voxels.bytes += packed.bytes.size();
    unsynced_ += packed.bytes.size();
    if (unsynced_ >= kSyncBytes) {
      if (!syncs_.empty()) syncs_.take();
      syncs_.start([this] { file_.beginSync(); });
      unsynced_ = 0;
    }
    pages.insert(pages.end(), packed.entries.begin(), packed.entries.end());
    for (const PageEntry& entry : packed.entries) {
      ++info_.pages[entry.codec];
      written_ += entry.subblocks;
    }
    if (options_.progress) options_.progress("write", written_, subblocks_);
  }

  void copyRecords(const TempBytes& records, Section& section) {
    BLOCKWALK_CHECK(records.size(), ==, section.bytes);
    RunningChecksum checksum;
    for (std::uint64_t at = 0; at < section.bytes; at += kPartBytes) {
      const auto bytes = std::min<std::uint64_t>(kPartBytes, section.bytes - at);
      const std::span<std::byte> part = std::span(part_).first(static_cast<std::size_t>(bytes));
      records.read(at, part);
      checksum.add(part);
      write(section.offset + at, part);
    }
    section.checksum = checksum.value();
  }

  // Of the volume, as are all offsets here.
  void write(std::uint64_t offset, std::span<const std::byte> bytes) { file_.write(begin_ + offset, bytes); }

  OutputFile& file_;
  std::uint64_t begin_;  // of the volume in the file
  VolumeInfo info_;
  const BuiltLevels& built_;
  const Spill& spill_;
  const BuildOptions& options_;
  std::string name_;  // for messages
  std::string metadata_;
  FileLayout layout_;
  std::vector<std::byte> part_;
  std::size_t channel_bytes_;  // of a subblock in one channel
  std::uint64_t subblocks_ = 0;
  std::uint64_t written_ = 0;
  std::uint64_t voxels_end_ = 0;  // of those written so far
  std::vector<std::byte> spare_;  // memory of pages that are written
  std::uint64_t unsynced_ = 0;    // written since the disk was last told to begin
  Workers& workers_;
  JobsInOrder<void> syncs_;
};

}  // namespace

BuildReport writeVolume(OutputFile& file, std::uint64_t begin, const VolumeInfo& info, const BuiltLevels& built,
                        const Spill& spill, const BuildOptions& options, Workers& workers) {
  VolumeWriter writer(file, begin, info, built, spill, options, workers);
  for (const std::size_t index : fileOrder(info)) writer.writeEntry(index);
  return writer.finish();
}

}  // namespace blockwalk
