// SPDX-License-Identifier: Apache-2.0
#include "volume/file/header.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "volume/error.h"
#include "volume/file/channel.h"
#include "volume/plain_text.h"

namespace blockwalk {
namespace {

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
  check(header.source_name_bytes <= kMaxSourceNameBytes, FIELD(source_name_bytes), "at most 1024");
}

// Of several channels the header itself says nothing but their number.
void checkChannelCount(const FileHeader& header, const FieldCheck& check) {
  if (header.version == kFileVersion) {
    check(header.channel_count == 0, FIELD(channel_count), "0 in version 1");
    return;
  }
  check(header.channel_count >= 2 && header.channel_count <= kMaxChannels, FIELD(channel_count), "2..4 in version 2");
  check(static_cast<VoxelType>(header.type) != VoxelType::rgba8, FIELD(type),
        "2 (u8), 3 (u16) or 4 (f32) in version 2");
  const auto* bytes = reinterpret_cast<const unsigned char*>(&header.channel);
  for (std::size_t i = 0; i < sizeof header.channel; ++i) {
    check(bytes[i] == 0, "channel", offsetof(FileHeader, channel) + i, bytes[i], "0 in version 2");
  }
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

// Bounds the counts by the file's length before any arithmetic that they could overflow.
void checkCounts(const FileHeader& header, const LevelEntry& entry, std::size_t index, const FieldCheck& check) {
  const std::size_t at = sizeof(FileHeader) + index * sizeof(LevelEntry);
  const auto type = static_cast<VoxelType>(header.type);
  const std::uint64_t side = header.subblock_side;
  const std::uint64_t per_block = std::uint64_t{header.block_side} * header.block_side * header.block_side;
  const std::uint64_t bytes_each = side * side * side * voxelBytes(type) + subblockRecordBytes(type);
  check(entry.reserved == 0, "level reserved", at + offsetof(LevelEntry, reserved), entry.reserved, "0");
  check(entry.subblock_count <= header.file_bytes / bytes_each, "level subblock_count",
        at + offsetof(LevelEntry, subblock_count), entry.subblock_count, "what the file's length has room for");
  const bool fits = entry.block_count <= entry.subblock_count && entry.block_count < kNoBlock &&
                    (entry.subblock_count + per_block - 1) / per_block <= entry.block_count;
  check(fits, "level block_count", at + offsetof(LevelEntry, block_count), entry.block_count,
        fmt::format("1..{} subblocks a block and below 2^32 - 1", per_block));
}

// All channels of a level have the structure of its first.
void checkSameCounts(const LevelEntry& entry, const LevelEntry& first, std::size_t index, const FieldCheck& check) {
  const std::size_t at = sizeof(FileHeader) + index * sizeof(LevelEntry);
  check(entry.block_count == first.block_count, "level block_count", at + offsetof(LevelEntry, block_count),
        entry.block_count, fmt::format("channel 0's, {}", first.block_count));
  check(entry.subblock_count == first.subblock_count, "level subblock_count", at + offsetof(LevelEntry, subblock_count),
        entry.subblock_count, fmt::format("channel 0's, {}", first.subblock_count));
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

void checkSection(const Section& found, const Section& expected, std::string_view name, std::size_t at,
                  const FieldCheck& check) {
  check(found.offset == expected.offset, fmt::format("{} offset", name), at + offsetof(Section, offset), found.offset,
        fmt::format("{} for these counts", expected.offset));
  check(found.bytes == expected.bytes, fmt::format("{} size", name), at + offsetof(Section, bytes), found.bytes,
        fmt::format("{} for these counts", expected.bytes));
}

void checkLayout(const FileHeader& header, const FileLayout& found, const FileLayout& expected,
                 const FieldCheck& check) {
  for (std::size_t i = 0; i < found.entries.size(); ++i) {
    const std::size_t at = sizeof(FileHeader) + i * sizeof(LevelEntry);
    const LevelEntry& entry = found.entries[i];
    const LevelEntry& wanted = expected.entries[i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      check(entry.dims[axis] == wanted.dims[axis], "level dims", at + 4 * axis, entry.dims[axis],
            fmt::format("{}: level 0's, halved {} times", wanted.dims[axis], i / found.channels));
    }
    checkSection(entry.blocks, wanted.blocks, "block records", at + offsetof(LevelEntry, blocks), check);
    checkSection(entry.subblocks, wanted.subblocks, "subblock records", at + offsetof(LevelEntry, subblocks), check);
    checkSection(entry.chunk_checksums, wanted.chunk_checksums, "chunk checksums",
                 at + offsetof(LevelEntry, chunk_checksums), check);
    checkSection(entry.voxels, wanted.voxels, "voxels", at + offsetof(LevelEntry, voxels), check);
    check(entry.voxels.checksum == 0, "voxels checksum",
          at + offsetof(LevelEntry, voxels) + offsetof(Section, checksum), entry.voxels.checksum, "0");
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
  return info;
}

FileHeader headerOf(const VolumeInfo& info) {
  const bool several = info.channels.size() > 1;
  FileHeader header;
  header.magic = kFileMagic;
  header.version = several ? kFileVersionOfChannels : kFileVersion;
  header.type = static_cast<std::uint8_t>(info.type);
  header.subblock_side = static_cast<std::uint8_t>(info.subblock_side);
  header.block_side = static_cast<std::uint8_t>(info.block_side);
  header.level_count = static_cast<std::uint8_t>(info.levels.size());
  for (int axis = 0; axis < 3; ++axis) {
    header.dims[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(info.dims[axis]);
  }
  header.world_from_index = rowsOf(info.world_from_index);
  if (!several) header.channel = fieldsOf(info.channels[0]);
  header.source_name_bytes = static_cast<std::uint32_t>(info.source_name.size());
  header.channel_count = several ? static_cast<std::uint32_t>(info.channels.size()) : 0;
  return header;
}

// What must hold before any other byte is believed: magic, version, lengths, checksum.
FileHeader openHeader(std::span<const std::byte> start, std::uint64_t file_bytes, const FieldCheck& check) {
  if (start.size() < sizeof(FileHeader)) {
    failData("{}: {} bytes, but the header of a .bwv file alone has {}", check.file, file_bytes, sizeof(FileHeader));
  }
  FileHeader header;
  std::memcpy(&header, start.data(), sizeof header);
  if (header.magic != kFileMagic) failData("{}: not a .bwv file: the first 8 bytes are not its signature", check.file);
  check(header.version == kFileVersion || header.version == kFileVersionOfChannels, FIELD(version),
        fmt::format("{} or {} for this program", kFileVersion, kFileVersionOfChannels));
  check(header.file_bytes == file_bytes, FIELD(file_bytes), fmt::format("the file's length, {}", file_bytes));
  check(header.header_bytes >= sizeof(FileHeader) && header.header_bytes <= kMaxHeaderBytes, FIELD(header_bytes),
        fmt::format("{}..{}", sizeof(FileHeader), kMaxHeaderBytes));
  check(header.header_bytes <= start.size(), FIELD(header_bytes), "at most the file's length");
  const std::uint64_t checksum = headerChecksum(start.first(header.header_bytes));
  check(checksum == header.header_checksum, FIELD(header_checksum), fmt::format("{}, the header's own", checksum));
  return header;
}

// The channels' values, and where the version keeps them; behind the level entries in version 2.
struct DecodedChannels {
  std::vector<ChannelInfo> channels;
  std::vector<ChannelPlace> places;
};

DecodedChannels decodeChannels(const FileHeader& header, std::span<const std::byte> entries, std::size_t offset,
                               const FieldCheck& check) {
  const std::uint64_t voxels = std::uint64_t{header.dims[0]} * header.dims[1] * header.dims[2];  // at most 2^48
  DecodedChannels decoded;
  if (header.version == kFileVersion) {
    decoded.places.push_back({.offset = offsetof(FileHeader, channel), .prefix = ""});
    checkChannelFields(header.channel, decoded.places[0], voxels, check);
    decoded.channels.push_back(channelOf(header.channel));
    return decoded;
  }
  for (std::size_t i = 0; i < header.channel_count; ++i) {
    ChannelEntry entry;
    std::memcpy(&entry, entries.data() + i * sizeof entry, sizeof entry);
    decoded.places.push_back({.offset = offset + i * sizeof entry, .prefix = fmt::format("channel {} ", i)});
    checkChannelFields(entry.fields, decoded.places[i], voxels, check);
    checkChannelName(entry, decoded.places[i], check);
    decoded.channels.push_back(channelOf(entry.fields));
    decoded.channels[i].name.assign(entry.name.data(), entry.name_bytes);
  }
  return decoded;
}

// Takes the counts of the level entries once they are bounded.
std::vector<LevelInfo> decodeLevels(const FileHeader& header, const VolumeInfo& grid, const FileLayout& found,
                                    const FieldCheck& check) {
  std::vector<LevelInfo> levels;
  for (std::size_t i = 0; i < found.entries.size(); ++i) {
    const LevelEntry& entry = found.entries[i];
    checkCounts(header, entry, i, check);
    checkSameCounts(entry, found.entries[i - i % found.channels], i, check);
    if (i % found.channels != 0) continue;
    levels.push_back({.dims = levelDims(grid.dims, static_cast<int>(levels.size())),
                      .block_count = entry.block_count,
                      .subblock_count = entry.subblock_count,
                      .voxel_bytes = entry.subblock_count * grid.subblockVoxels() * voxelBytes(grid.type)});
  }
  return levels;
}

}  // namespace

std::uint64_t checksumOf(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

std::vector<std::byte> encodeHeader(const VolumeInfo& info, const FileLayout& layout) {
  FileHeader header = headerOf(info);
  header.header_bytes = layout.header_bytes;
  header.file_bytes = layout.file_bytes;
  std::vector<std::byte> bytes(layout.header_bytes);
  std::byte* at = bytes.data();
  const auto put = [&at](const void* from, std::size_t size) {
    std::memcpy(at, from, size);
    at += size;
  };
  put(&header, sizeof header);
  put(layout.entries.data(), layout.entries.size() * sizeof(LevelEntry));
  for (std::size_t i = 0; layout.channels > 1 && i < layout.channels; ++i) {
    const ChannelEntry entry = entryOf(info.channels[i]);
    put(&entry, sizeof entry);
  }
  put(info.source_name.data(), info.source_name.size());
  const std::uint64_t checksum = headerChecksum(bytes);
  std::memcpy(bytes.data() + kHeaderChecksumOffset, &checksum, sizeof checksum);
  return bytes;
}

DecodedHeader decodeHeader(std::span<const std::byte> start, std::uint64_t file_bytes, const std::string& file) {
  const FieldCheck check{file};
  const FileHeader header = openHeader(start, file_bytes, check);
  checkShape(header, check);
  checkChannelCount(header, check);
  checkMap(header, check);
  FileLayout found;
  found.channels = std::max<std::size_t>(header.channel_count, 1);
  found.entries.resize(header.level_count * found.channels);
  const std::size_t channels_at = sizeof(FileHeader) + found.entries.size() * sizeof(LevelEntry);
  const std::size_t name_at = channels_at + header.channel_count * sizeof(ChannelEntry);
  check(header.header_bytes == name_at + header.source_name_bytes, FIELD(header_bytes),
        "the sizes of its parts together");
  std::memcpy(found.entries.data(), start.data() + sizeof header, found.entries.size() * sizeof(LevelEntry));

  DecodedChannels channels = decodeChannels(header, start.subspan(channels_at), channels_at, check);
  DecodedHeader decoded{.info = gridOf(header), .layout = {}};
  decoded.info.channels = std::move(channels.channels);
  const auto* name = reinterpret_cast<const char*>(start.data() + name_at);
  decoded.info.source_name.assign(name, header.source_name_bytes);
  if (!isPlainText(decoded.info.source_name)) {
    failData("{}: source name at offset {} must be UTF-8 without control characters", file, name_at);
  }
  decoded.info.levels = decodeLevels(header, decoded.info, found, check);
  checkNonempty(decoded.info, decoded.info.levels[0].subblock_count, channels.places, check);
  decoded.layout = layOutFile(decoded.info);
  checkLayout(header, found, decoded.layout, check);
  decoded.layout.entries = std::move(found.entries);
  return decoded;
}

}  // namespace blockwalk
