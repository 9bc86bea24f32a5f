// SPDX-License-Identifier: Apache-2.0
#include "volume/file/header.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "volume/error.h"
#include "volume/file/channel.h"
#include "volume/file/checksum.h"
#include "volume/file/metadata.h"

namespace blockwalk {
namespace {

constexpr std::size_t kMaxHeaderBytes = sizeof(FileHeader) +
                                        kMaxLevels * (sizeof(LevelEntry) + kMaxChannels * sizeof(ChannelSections)) +
                                        kMaxChannels * sizeof(ChannelEntry) + kMaxMetadataBytes;
constexpr std::size_t kHeaderChecksumOffset = offsetof(FileHeader, header_checksum);

std::uint64_t headerChecksum(std::span<const std::byte> header) {
  std::vector<std::byte> copy(header.begin(), header.end());
  std::memset(copy.data() + kHeaderChecksumOffset, 0, sizeof(std::uint64_t));
  return checksumOf(copy);
}

#define FIELD(name) #name, offsetof(FileHeader, name), header.name

std::array<double, 12> rowsOf(const glm::dmat4& map) {
  std::array<double, 12> rows{};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) rows[static_cast<std::size_t>(row * 4 + column)] = map[column][row];
  }
  return rows;
}

glm::dmat4 mapOf(const std::array<double, 12>& rows) {
  glm::dmat4 map(1.0);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) map[column][row] = rows[static_cast<std::size_t>(row * 4 + column)];
  }
  return map;
}

void checkShape(const FileHeader& header, const FieldCheck& check) {
  check(header.type >= 1 && header.type <= 4, FIELD(type), "1 (rgba8), 2 (u8), 3 (u16) or 4 (f32)");
  check(header.subblock_side == 4 || header.subblock_side == 8 || header.subblock_side == 16, FIELD(subblock_side),
        "4, 8 or 16");
  check(header.block_side >= 1 && header.block_side <= kMaxBlockSide, FIELD(block_side), "1..6");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    check(header.dims[axis] >= 1 && header.dims[axis] <= kMaxDim, "dims", offsetof(FileHeader, dims) + 4 * axis,
          header.dims[axis], "1..65536");
  }
  const glm::ivec3 dims(header.dims[0], header.dims[1], header.dims[2]);
  const int levels = levelCount(dims, header.subblock_side * header.block_side);
  check(header.level_count == levels, FIELD(level_count), fmt::format("{} for these dims", levels));
  const bool color = static_cast<VoxelType>(header.type) == VoxelType::rgba8;
  check(header.channel_count >= 1 && header.channel_count <= (color ? 1 : kMaxChannels), FIELD(channel_count),
        color ? "1 for rgba8" : "1..4");
  const int maxima = std::max(0, levels - kFirstMaximaLevel);
  check(header.maxima_count == 0 || static_cast<int>(header.maxima_count) == maxima, FIELD(maxima_count),
        fmt::format("0 or {}, for level {} and on", maxima, kFirstMaximaLevel));
  check(header.metadata_bytes <= kMaxMetadataBytes, FIELD(metadata_bytes),
        fmt::format("at most {}", kMaxMetadataBytes));
  check(header.group_records == 0 || header.group_records == kGroupRecords, FIELD(group_records),
        fmt::format("0 or {}", kGroupRecords));
}

// What has room and no meaning yet.
void checkUnused(const FileHeader& header, const FieldCheck& check) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    check(header.part_origin[axis] == 0, "part_origin", offsetof(FileHeader, part_origin) + 4 * axis,
          header.part_origin[axis], "0 in version 3");
    check(header.whole_dims[axis] == 0, "whole_dims", offsetof(FileHeader, whole_dims) + 4 * axis,
          header.whole_dims[axis], "0 in version 3");
  }
  check(header.time_step == 0, FIELD(time_step), "0 in version 3");
  check(header.time_steps == 0, FIELD(time_steps), "0 in version 3");
}

void checkMap(const FileHeader& header, const FieldCheck& check) {
  for (std::size_t i = 0; i < header.world_from_index.size(); ++i) {
    check(std::isfinite(header.world_from_index[i]), "world_from_index", offsetof(FileHeader, world_from_index) + 8 * i,
          header.world_from_index[i], "finite");
  }
  const double determinant = glm::determinant(glm::dmat3(mapOf(header.world_from_index)));
  check(std::isfinite(1 / determinant) && std::isfinite(determinant), "world_from_index",
        offsetof(FileHeader, world_from_index), determinant, "a map with a finite determinant that is not 0");
}

std::size_t entriesOf(const FileHeader& header) { return std::size_t{header.level_count} + header.maxima_count; }

// "level 2" or "level 2 maxima"
std::string entryName(std::size_t index, std::size_t levels) {
  const EntryPlace place = entryPlace(index, levels);
  return fmt::format("level {}{}", place.level, place.form == Form::maxima ? " maxima" : "");
}

// Where the parts of the header begin.
struct HeaderParts {
  explicit HeaderParts(const FileHeader& header)
      : level_entries(sizeof(FileHeader)),
        sections(level_entries + entriesOf(header) * sizeof(LevelEntry)),
        channels(sections + entriesOf(header) * header.channel_count * sizeof(ChannelSections)),
        metadata(channels + header.channel_count * sizeof(ChannelEntry)),
        end(metadata + header.metadata_bytes) {}

  std::size_t level_entries;
  std::size_t sections;
  std::size_t channels;
  std::size_t metadata;
  std::size_t end;
};

// Bounds the counts by the file's length before any arithmetic that they could overflow: each subblock and block has
// bytes of its own in the records.
void checkCounts(const FileHeader& header, const LevelEntry& entry, std::size_t index, const FieldCheck& check) {
  const std::size_t at = sizeof(FileHeader) + index * sizeof(LevelEntry);
  const auto type = static_cast<VoxelType>(header.type);
  const std::uint64_t per_block = std::uint64_t{header.block_side} * header.block_side * header.block_side;
  const auto field = [&](bool holds, std::string_view name, std::size_t offset, std::uint64_t value,
                         std::string_view bound) {
    check(holds, fmt::format("{} {}", entryName(index, header.level_count), name), at + offset, value, bound);
  };
  field(entry.reserved == 0, "reserved", offsetof(LevelEntry, reserved), entry.reserved, "0");
  const std::uint64_t most = std::min(header.file_bytes / apronRangeBytes(type), kMaxSubblocks);
  field(entry.apron_subblock_count <= most, "apron_subblock_count", offsetof(LevelEntry, apron_subblock_count),
        entry.apron_subblock_count,
        fmt::format("at most {}: what the file's length has room for, and below 2^32 - 1", most));
  field(entry.subblock_count <= entry.apron_subblock_count, "subblock_count", offsetof(LevelEntry, subblock_count),
        entry.subblock_count, "at most apron_subblock_count");
  const auto fits = [&](std::uint64_t blocks, std::uint64_t subblocks) {
    return blocks <= subblocks && (subblocks + per_block - 1) / per_block <= blocks;
  };
  const std::string bound = fmt::format("1..{} subblocks a block", per_block);
  field(fits(entry.block_count, entry.subblock_count), "block_count", offsetof(LevelEntry, block_count),
        entry.block_count, bound);
  field(fits(entry.apron_block_count, entry.apron_subblock_count) && entry.apron_block_count >= entry.block_count,
        "apron_block_count", offsetof(LevelEntry, apron_block_count), entry.apron_block_count,
        bound + " and at least block_count");
  const glm::ivec3 dims =
      levelDims({header.dims[0], header.dims[1], header.dims[2]}, entryPlace(index, header.level_count).level);
  const std::uint64_t cells = cellCount(latticeDims(dims, header.subblock_side * header.block_side));
  field(entry.apron_block_count <= cells, "apron_block_count", offsetof(LevelEntry, apron_block_count),
        entry.apron_block_count, fmt::format("at most {}, which the level has room for", cells));
  const std::uint64_t largest = entry.apron_block_count * largestBlockRecordBytes(header.block_side);
  field(entry.blocks.bytes >= entry.apron_block_count * kLeastBlockRecordBytes && entry.blocks.bytes <= largest &&
            entry.blocks.bytes <= header.file_bytes,
        "block records size", offsetof(LevelEntry, blocks) + offsetof(Section, bytes), entry.blocks.bytes,
        "that of its blocks");
}

// Every stored subblock of level 0 has a non-empty voxel, in some channel.
void checkNonempty(const VolumeInfo& info, std::uint64_t subblocks, std::span<const ChannelPlace> places,
                   const FieldCheck& check) {
  std::uint64_t all = 0;
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    const std::uint64_t nonempty = info.channels[i].nonempty_voxels;
    all += nonempty;
    const bool last = i + 1 == info.channels.size();
    check(nonempty <= subblocks * info.subblockVoxels() && (!last || all >= subblocks),
          places[i].name("nonempty_voxels"), places[i].offset + offsetof(ChannelFields, nonempty_voxels), nonempty,
          "at least one a subblock of level 0 and at most all of them");
  }
}

void checkSection(const Section& found, const Section& expected, const std::string& name, std::size_t at,
                  const FieldCheck& check) {
  check(found.offset == expected.offset, name + " offset", at + offsetof(Section, offset), found.offset,
        fmt::format("{} for these counts", expected.offset));
  check(found.bytes == expected.bytes, name + " size", at + offsetof(Section, bytes), found.bytes,
        fmt::format("{} for these counts", expected.bytes));
}

void checkLayout(const FileHeader& header, const HeaderParts& parts, const FileLayout& found,
                 const FileLayout& expected, const FieldCheck& check) {
  for (std::size_t i = 0; i < found.entries.size(); ++i) {
    const std::size_t at = parts.level_entries + i * sizeof(LevelEntry);
    const std::string name = entryName(i, header.level_count);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      check(found.entries[i].dims[axis] == expected.entries[i].dims[axis], name + " dims", at + 4 * axis,
            found.entries[i].dims[axis], fmt::format("{}: level 0's, halved", expected.entries[i].dims[axis]));
    }
    checkSection(found.entries[i].blocks, expected.entries[i].blocks, name + " block records",
                 at + offsetof(LevelEntry, blocks), check);
  }
  for (std::size_t i = 0; i < found.sections.size(); ++i) {
    const std::size_t at = parts.sections + i * sizeof(ChannelSections);
    const ChannelSections& own = found.sections[i];
    const ChannelSections& wanted = expected.sections[i];
    const std::string name =
        fmt::format("{} channel {} ", entryName(i / found.channels, header.level_count), i % found.channels);
    checkSection(own.ranges, wanted.ranges, name + "ranges", at + offsetof(ChannelSections, ranges), check);
    checkSection(own.apron_ranges, wanted.apron_ranges, name + "apron ranges",
                 at + offsetof(ChannelSections, apron_ranges), check);
    checkSection(own.pages, wanted.pages, name + "pages", at + offsetof(ChannelSections, pages), check);
    checkSection(own.voxels, wanted.voxels, name + "voxels", at + offsetof(ChannelSections, voxels), check);
    check(own.voxels.checksum == 0, name + "voxels checksum",
          at + offsetof(ChannelSections, voxels) + offsetof(Section, checksum), own.voxels.checksum, "0");
  }
  check(header.file_bytes == expected.file_bytes, FIELD(file_bytes),
        fmt::format("{}, the end of level 0's voxels", expected.file_bytes));
}

VolumeInfo gridOf(const FileHeader& header) {
  VolumeInfo info;
  info.type = static_cast<VoxelType>(header.type);
  info.dims = {header.dims[0], header.dims[1], header.dims[2]};
  info.subblock_side = header.subblock_side;
  info.block_side = header.block_side;
  info.world_from_index = mapOf(header.world_from_index);
  info.channels.clear();
  return info;
}

FileHeader headerOf(const VolumeInfo& info) {
  FileHeader header;
  header.magic = kFileMagic;
  header.version = kFileVersion;
  header.type = static_cast<std::uint8_t>(info.type);
  header.subblock_side = static_cast<std::uint8_t>(info.subblock_side);
  header.block_side = static_cast<std::uint8_t>(info.block_side);
  header.level_count = static_cast<std::uint8_t>(info.levels.size());
  for (int axis = 0; axis < 3; ++axis) {
    header.dims[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(info.dims[axis]);
  }
  header.world_from_index = rowsOf(info.world_from_index);
  header.channel_count = static_cast<std::uint32_t>(info.channels.size());
  header.maxima_count = static_cast<std::uint32_t>(info.maxima.size());
  return header;
}

FileHeader fileHeaderOf(std::span<const std::byte> start, std::uint64_t file_bytes, const FieldCheck& check) {
  if (start.size() < sizeof(FileHeader)) {
    failData("{}: {} bytes, but the header of a .bwv file alone has {}", check.file, file_bytes, sizeof(FileHeader));
  }
  FileHeader header;
  std::memcpy(&header, start.data(), sizeof header);
  return header;
}

// The channels' entries, and where they stand.
std::vector<ChannelPlace> decodeChannels(const FileHeader& header, std::span<const std::byte> bytes,
                                         const HeaderParts& parts, const FieldCheck& check, VolumeInfo& info) {
  const std::uint64_t voxels = std::uint64_t{header.dims[0]} * header.dims[1] * header.dims[2];  // at most 2^48
  std::vector<ChannelPlace> places;
  for (std::size_t i = 0; i < header.channel_count; ++i) {
    ChannelEntry entry;
    const std::size_t at = parts.channels + i * sizeof entry;
    std::memcpy(&entry, bytes.data() + at, sizeof entry);
    places.push_back({.offset = at, .prefix = fmt::format("channel {} ", i)});
    checkChannel(entry, places[i], info.type, voxels, check);
    info.channels.push_back(channelOf(entry));
  }
  return places;
}

FileLayout decodeEntries(const FileHeader& header, std::span<const std::byte> bytes, const HeaderParts& parts) {
  FileLayout found;
  found.channels = header.channel_count;
  found.entries.resize(entriesOf(header));
  found.sections.resize(entriesOf(header) * found.channels);
  std::memcpy(found.entries.data(), bytes.data() + parts.level_entries, found.entries.size() * sizeof(LevelEntry));
  std::memcpy(found.sections.data(), bytes.data() + parts.sections, found.sections.size() * sizeof(ChannelSections));
  return found;
}

// Takes the counts of the level entries once they are bounded, and the sizes that do not follow from them.
FileSizes decodeLevels(const FileHeader& header, const HeaderParts& parts, const FileLayout& found,
                       const FieldCheck& check, VolumeInfo& info) {
  FileSizes sizes{.blocks = {}, .voxels = {}, .metadata = header.metadata_bytes, .group_records = header.group_records};
  for (std::size_t i = 0; i < found.entries.size(); ++i) {
    const LevelEntry& entry = found.entries[i];
    const EntryPlace place = entryPlace(i, header.level_count);
    checkCounts(header, entry, i, check);
    std::vector<LevelInfo>& levels = place.form == Form::values ? info.levels : info.maxima;
    levels.push_back({.dims = levelDims(info.dims, place.level),
                      .block_count = entry.block_count,
                      .subblock_count = entry.subblock_count,
                      .voxel_bytes = entry.subblock_count * info.subblockVoxels() * voxelBytes(info.type),
                      .apron_block_count = entry.apron_block_count,
                      .apron_subblock_count = entry.apron_subblock_count});
    sizes.blocks.push_back(entry.blocks.bytes);
  }
  for (std::size_t i = 0; i < found.sections.size(); ++i) {
    // Held against the pages when those are read.
    const std::uint64_t bytes = found.sections[i].voxels.bytes;
    check(
        bytes <= header.file_bytes,
        fmt::format("{} channel {} voxels size", entryName(i / found.channels, header.level_count), i % found.channels),
        parts.sections + i * sizeof(ChannelSections) + offsetof(ChannelSections, voxels) + offsetof(Section, bytes),
        bytes, "at most the file's length");
    sizes.voxels.push_back(bytes);
  }
  return sizes;
}

}  // namespace

std::vector<std::byte> encodeHeader(const VolumeInfo& info, const FileLayout& layout, const std::string& metadata) {
  FileHeader header = headerOf(info);
  header.header_bytes = layout.header_bytes;
  header.group_records = layout.group_records;
  header.file_bytes = layout.file_bytes;
  header.metadata_bytes = static_cast<std::uint32_t>(metadata.size());
  std::vector<std::byte> bytes(layout.header_bytes);
  std::size_t end = 0;
  const auto put = [&](const void* from, std::size_t size) {
    BLOCKWALK_CHECK(size, <=, bytes.size() - end);
    if (size > 0) std::memcpy(bytes.data() + end, from, size);
    end += size;
  };
  put(&header, sizeof header);
  put(layout.entries.data(), layout.entries.size() * sizeof(LevelEntry));
  put(layout.sections.data(), layout.sections.size() * sizeof(ChannelSections));
  for (const ChannelInfo& channel : info.channels) {
    const ChannelEntry entry = entryOf(channel);
    put(&entry, sizeof entry);
  }
  put(metadata.data(), metadata.size());
  BLOCKWALK_CHECK(end, ==, bytes.size());
  const std::uint64_t checksum = headerChecksum(bytes);
  std::memcpy(bytes.data() + kHeaderChecksumOffset, &checksum, sizeof checksum);
  return bytes;
}

std::size_t headerBytes(std::span<const std::byte> start, std::uint64_t file_bytes, const std::string& file) {
  const FieldCheck check{file};
  const FileHeader header = fileHeaderOf(start, file_bytes, check);
  if (header.magic != kFileMagic) failData("{}: not a .bwv file: the first 8 bytes are not its signature", file);
  if (header.version == 1 || header.version == 2) {
    failData(
        "{}: version {} of the format, which is no longer read; make it anew from its source: "
        "blockwalk import SOURCE -o {}",
        file, header.version, file);
  }
  check(header.version == kFileVersion, FIELD(version), fmt::format("{} for this program", kFileVersion));
  check(header.file_bytes == file_bytes, FIELD(file_bytes), fmt::format("the file's length, {}", file_bytes));
  check(header.header_bytes >= sizeof(FileHeader) && header.header_bytes <= kMaxHeaderBytes, FIELD(header_bytes),
        fmt::format("{}..{}", sizeof(FileHeader), kMaxHeaderBytes));
  check(header.header_bytes <= file_bytes, FIELD(header_bytes), "at most the file's length");
  return header.header_bytes;
}

DecodedHeader decodeHeader(std::span<const std::byte> bytes, std::uint64_t file_bytes, const std::string& file) {
  const FieldCheck check{file};
  BLOCKWALK_CHECK(bytes.size(), ==, headerBytes(bytes, file_bytes, file));
  const FileHeader header = fileHeaderOf(bytes, file_bytes, check);
  const std::uint64_t checksum = headerChecksum(bytes);
  check(checksum == header.header_checksum, FIELD(header_checksum), fmt::format("{}, the header's own", checksum));
  checkShape(header, check);
  checkUnused(header, check);
  checkMap(header, check);
  const HeaderParts parts(header);
  check(header.header_bytes == parts.end, FIELD(header_bytes), "the sizes of its parts together");

  DecodedHeader decoded{.info = gridOf(header), .layout = {}};
  VolumeInfo& info = decoded.info;
  const std::vector<ChannelPlace> places = decodeChannels(header, bytes, parts, check, info);
  const auto* metadata = reinterpret_cast<const char*>(bytes.data() + parts.metadata);
  decodeMetadata({metadata, header.metadata_bytes}, parts.metadata, file, info);
  FileLayout found = decodeEntries(header, bytes, parts);
  const FileSizes sizes = decodeLevels(header, parts, found, check, info);
  checkNonempty(info, info.levels[0].subblock_count, places, check);
  const FileLayout expected = layOutFile(info, sizes);
  checkLayout(header, parts, found, expected, check);
  found.header_bytes = expected.header_bytes;
  found.file_bytes = expected.file_bytes;
  found.group_records = expected.group_records;
  found.indices = expected.indices;
  decoded.layout = std::move(found);
  return decoded;
}

}  // namespace blockwalk
