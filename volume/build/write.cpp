// SPDX-License-Identifier: Apache-2.0
#include "volume/build/write.h"

#include <xxhash.h>

#include <algorithm>
#include <memory>
#include <new>
#include <utility>

#include "volume/error.h"
#include "volume/file/header.h"

namespace blockwalk {
namespace {

// XXH3-64 of bytes that come in parts.
class RunningChecksum {
 public:
  RunningChecksum() : state_(XXH3_createState(), &XXH3_freeState) {
    if (!state_) throw std::bad_alloc();
    XXH3_64bits_reset(state_.get());
  }
  void add(std::span<const std::byte> bytes) { XXH3_64bits_update(state_.get(), bytes.data(), bytes.size()); }
  std::uint64_t value() const { return XXH3_64bits_digest(state_.get()); }

 private:
  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state_;
};

class VolumeWriter {
 public:
  VolumeWriter(const std::filesystem::path& path, const VolumeInfo& info, const BuildOptions& options)
      : info_(info),
        options_(options),
        path_(path),
        layout_(layOutFile(info)),
        file_(path, layout_.file_bytes),
        part_(kChunkBytes),
        channel_bytes_(static_cast<std::size_t>(info.subblockVoxels()) * voxelBytes(info.type)) {
    for (const LevelInfo& level : info.levels) subblocks_ += level.subblock_count * info.channels.size();
  }

  void writeLevel(std::size_t index, const BuiltLevel& level, const TempBytes& spill) {
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      LevelEntry& entry = layout_.entry(index, channel);
      copyRecords(level.channels[channel].blocks, entry.blocks);
      copyRecords(level.channels[channel].subblocks, entry.subblocks);
      if (index > 0) {
        const TempBytes& voxels = level.channels[channel].voxels;
        writeVoxels(entry, [&](std::uint64_t at, std::span<std::byte> chunk) { voxels.read(at, chunk); });
        continue;
      }
      const SlotPart part{.slot_bytes = channel_bytes_ * info_.channels.size(),
                          .offset = channel * channel_bytes_,
                          .bytes = channel_bytes_};
      std::vector<std::uint64_t> slots;
      writeVoxels(entry, [&](std::uint64_t at, std::span<std::byte> chunk) {
        slots.resize(chunk.size() / channel_bytes_);
        level.slots.read(at / channel_bytes_ * sizeof(std::uint64_t), std::as_writable_bytes(std::span(slots)));
        loadSlots(spill, slots, part, chunk);
      });
    }
  }

  BuildReport finish() {
    const std::vector<std::byte> header = encodeHeader(info_, layout_);
    decodeHeader(header, layout_.file_bytes, path_.string());  // what a reader would refuse gets no name
    file_.write(0, header);
    file_.commit();
    BuildReport report{.info = info_, .file_bytes = layout_.file_bytes};
    for (std::size_t i = 0; i < layout_.entries.size(); ++i) {
      const LevelEntry& entry = layout_.entries[i];
      if (i < layout_.channels) {
        report.level0_voxel_bytes += entry.voxels.bytes;
      } else {
        report.coarser_level_bytes +=
            entry.blocks.bytes + entry.subblocks.bytes + entry.chunk_checksums.bytes + entry.voxels.bytes;
      }
    }
    report.overhead_bytes = report.file_bytes - report.level0_voxel_bytes - report.coarser_level_bytes;
    return report;
  }

 private:
  // `read(at, chunk)` fills a chunk with the section's bytes from `at` on. A subblock divides a chunk.
  template <typename Read>
  void writeVoxels(LevelEntry& entry, Read read) {
    std::vector<std::uint64_t> sums;
    for (std::uint64_t at = 0; at < entry.voxels.bytes; at += kChunkBytes) {
      const auto bytes = std::min<std::uint64_t>(kChunkBytes, entry.voxels.bytes - at);
      const std::span<std::byte> chunk = std::span(part_).first(static_cast<std::size_t>(bytes));
      read(at, chunk);
      sums.push_back(checksumOf(chunk));
      file_.write(entry.voxels.offset + at, chunk);
      written_ += bytes / channel_bytes_;
      if (options_.progress) options_.progress("write", written_, subblocks_);
    }
    const auto sum_bytes = std::as_bytes(std::span(sums));
    BLOCKWALK_CHECK(sum_bytes.size(), ==, entry.chunk_checksums.bytes);
    file_.write(entry.chunk_checksums.offset, sum_bytes);
    entry.chunk_checksums.checksum = checksumOf(sum_bytes);
  }

  void copyRecords(const TempBytes& records, Section& section) {
    BLOCKWALK_CHECK(records.size(), ==, section.bytes);
    RunningChecksum checksum;
    for (std::uint64_t at = 0; at < section.bytes; at += kChunkBytes) {
      const auto bytes = std::min<std::uint64_t>(kChunkBytes, section.bytes - at);
      const std::span<std::byte> part = std::span(part_).first(static_cast<std::size_t>(bytes));
      records.read(at, part);
      checksum.add(part);
      file_.write(section.offset + at, part);
    }
    section.checksum = checksum.value();
  }

  const VolumeInfo& info_;
  const BuildOptions& options_;
  std::filesystem::path path_;
  FileLayout layout_;
  OutputFile file_;
  std::vector<std::byte> part_;
  std::size_t channel_bytes_;  // of a subblock in one channel
  std::uint64_t subblocks_ = 0;
  std::uint64_t written_ = 0;
};

}  // namespace

BuildReport writeVolume(const std::filesystem::path& path, const VolumeInfo& info,
                        const std::vector<BuiltLevel>& levels, const TempBytes& spill, const BuildOptions& options) {
  VolumeWriter writer(path, info, options);
  for (std::size_t i = levels.size(); i-- > 0;) writer.writeLevel(i, levels[i], spill);
  return writer.finish();
}

}  // namespace blockwalk
