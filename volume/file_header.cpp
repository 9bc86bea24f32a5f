// SPDX-License-Identifier: Apache-2.0
#include "volume/file_header.h"

#include <xxhash.h>

#include <cmath>
#include <cstring>
#include <string_view>

#include "volume/error.h"
#include "volume/source_name.h"

namespace blockwalk {
namespace {

constexpr std::size_t kHeaderChecksumOffset = offsetof(FileHeader, header_checksum);

std::uint64_t headerChecksum(std::span<const std::byte> header) {
  std::vector<std::byte> copy(header.begin(), header.end());
  std::memset(copy.data() + kHeaderChecksumOffset, 0, sizeof(std::uint64_t));
  return checksumOf(copy);
}

// Throws for one field. A struct so that the checks below read as a list.
struct FieldCheck {
  const std::string& file;

  template <typename T>
  void operator()(bool holds, std::string_view field, std::size_t offset, const T& value,
                  std::string_view bound) const {
    if (!holds) failData("{}: header field {} at offset {} is {}, must be {}", file, field, offset, value, bound);
  }
};
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
  check(header.reserved == 0, FIELD(reserved), "0");
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

void checkValues(const FileHeader& header, const FieldCheck& check) {
  check(std::isfinite(header.value_scale) && header.value_scale > 0, FIELD(value_scale), "finite and above 0");
  check(std::isfinite(header.value_offset), FIELD(value_offset), "finite");
  check(std::isfinite(header.largest_rounding) && header.largest_rounding >= 0, FIELD(largest_rounding),
        "finite and at least 0");
  check(std::isfinite(header.empty_threshold), FIELD(empty_threshold), "finite");
  check(std::isfinite(header.density_min), FIELD(density_min), "finite");
  check(std::isfinite(header.density_max) && header.density_max >= header.density_min, FIELD(density_max),
        "finite and at least density_min");
  check(header.nonempty_voxels == 0 || header.density_min > header.empty_threshold, FIELD(density_min),
        "above empty_threshold");
  check(std::isfinite(header.histogram_lo), FIELD(histogram_lo), "finite");
  check(std::isfinite(header.histogram_hi) && header.histogram_hi >= header.histogram_lo, FIELD(histogram_hi),
        "finite and at least histogram_lo");
  for (std::size_t i = 0; i < header.bin_cuts.size(); ++i) {
    const float before = i == 0 ? header.bin_cuts[0] : header.bin_cuts[i - 1];
    check(std::isfinite(header.bin_cuts[i]) && header.bin_cuts[i] >= before, "bin_cuts",
          offsetof(FileHeader, bin_cuts) + 4 * i, header.bin_cuts[i], "finite and ascending");
  }
  const std::uint64_t voxels = std::uint64_t{header.dims[0]} * header.dims[1] * header.dims[2];  // at most 2^48
  check(header.nonempty_voxels <= voxels, FIELD(nonempty_voxels), "at most the number of voxels");
  check(header.nonfinite_voxels <= voxels, FIELD(nonfinite_voxels), "at most the number of voxels");
  std::uint64_t left = header.nonempty_voxels;
  for (std::size_t i = 0; i < header.histogram.size(); ++i) {
    check(header.histogram[i] <= left, "histogram", offsetof(FileHeader, histogram) + 8 * i, header.histogram[i],
          "such that all bins add up to nonempty_voxels");
    left -= header.histogram[i];
  }
  check(left == 0, FIELD(nonempty_voxels), "the sum of the histogram");
}

// Bounds the counts by the file's length before any arithmetic that they could overflow.
void checkCounts(const FileHeader& header, const LevelEntry& entry, int level, const FieldCheck& check) {
  const std::size_t at = sizeof(FileHeader) + static_cast<std::size_t>(level) * sizeof(LevelEntry);
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
  if (level == 0) {
    check(header.nonempty_voxels >= entry.subblock_count &&
              header.nonempty_voxels <= entry.subblock_count * side * side * side,
          FIELD(nonempty_voxels), "at least one a subblock of level 0 and at most all of them");
  }
}

void checkSection(const Section& found, const Section& expected, std::string_view name, std::size_t at,
                  const FieldCheck& check) {
  check(found.offset == expected.offset, fmt::format("{} offset", name), at + offsetof(Section, offset), found.offset,
        fmt::format("{} for these counts", expected.offset));
  check(found.bytes == expected.bytes, fmt::format("{} size", name), at + offsetof(Section, bytes), found.bytes,
        fmt::format("{} for these counts", expected.bytes));
}

void checkLayout(const FileHeader& header, const std::vector<LevelEntry>& entries, const FileLayout& expected,
                 const FieldCheck& check) {
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const std::size_t at = sizeof(FileHeader) + i * sizeof(LevelEntry);
    const LevelEntry& entry = entries[i];
    const LevelEntry& wanted = expected.levels[i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      check(entry.dims[axis] == wanted.dims[axis], "level dims", at + 4 * axis, entry.dims[axis],
            fmt::format("{}: level 0's, halved {} times", wanted.dims[axis], i));
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

VolumeInfo infoOf(const FileHeader& header) {
  VolumeInfo info;
  info.type = static_cast<VoxelType>(header.type);
  info.dims = {header.dims[0], header.dims[1], header.dims[2]};
  info.subblock_side = header.subblock_side;
  info.block_side = header.block_side;
  info.world_from_index = mapOf(header.world_from_index);
  info.channels[0].value_scale = header.value_scale;
  info.channels[0].value_offset = header.value_offset;
  info.channels[0].empty_threshold = header.empty_threshold;
  info.channels[0].density_min = header.density_min;
  info.channels[0].density_max = header.density_max;
  info.channels[0].bin_cuts = header.bin_cuts;
  info.channels[0].histogram_lo = header.histogram_lo;
  info.channels[0].histogram_hi = header.histogram_hi;
  info.channels[0].histogram = header.histogram;
  info.channels[0].nonempty_voxels = header.nonempty_voxels;
  info.channels[0].nonfinite_voxels = header.nonfinite_voxels;
  info.channels[0].largest_rounding = header.largest_rounding;
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
  header.value_scale = info.channels[0].value_scale;
  header.value_offset = info.channels[0].value_offset;
  header.largest_rounding = info.channels[0].largest_rounding;
  header.nonempty_voxels = info.channels[0].nonempty_voxels;
  header.nonfinite_voxels = info.channels[0].nonfinite_voxels;
  header.empty_threshold = info.channels[0].empty_threshold;
  header.density_min = info.channels[0].density_min;
  header.density_max = info.channels[0].density_max;
  header.histogram_lo = info.channels[0].histogram_lo;
  header.histogram_hi = info.channels[0].histogram_hi;
  header.bin_cuts = info.channels[0].bin_cuts;
  header.histogram = info.channels[0].histogram;
  header.source_name_bytes = static_cast<std::uint32_t>(info.source_name.size());
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
  check(header.version == kFileVersion, FIELD(version), fmt::format("{} for this program", kFileVersion));
  check(header.file_bytes == file_bytes, FIELD(file_bytes), fmt::format("the file's length, {}", file_bytes));
  check(header.header_bytes >= sizeof(FileHeader) && header.header_bytes <= kMaxHeaderBytes, FIELD(header_bytes),
        fmt::format("{}..{}", sizeof(FileHeader), kMaxHeaderBytes));
  check(header.header_bytes <= start.size(), FIELD(header_bytes), "at most the file's length");
  const std::uint64_t checksum = headerChecksum(start.first(header.header_bytes));
  check(checksum == header.header_checksum, FIELD(header_checksum), fmt::format("{}, the header's own", checksum));
  return header;
}

}  // namespace

std::uint64_t checksumOf(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

std::vector<std::byte> encodeHeader(const VolumeInfo& info, const FileLayout& layout) {
  FileHeader header = headerOf(info);
  header.header_bytes = layout.header_bytes;
  header.file_bytes = layout.file_bytes;
  std::vector<std::byte> bytes(layout.header_bytes);
  std::memcpy(bytes.data(), &header, sizeof header);
  std::byte* at = bytes.data() + sizeof header;
  std::memcpy(at, layout.levels.data(), layout.levels.size() * sizeof(LevelEntry));
  at += layout.levels.size() * sizeof(LevelEntry);
  std::memcpy(at, info.source_name.data(), info.source_name.size());
  const std::uint64_t checksum = headerChecksum(bytes);
  std::memcpy(bytes.data() + kHeaderChecksumOffset, &checksum, sizeof checksum);
  return bytes;
}

DecodedHeader decodeHeader(std::span<const std::byte> start, std::uint64_t file_bytes, const std::string& file) {
  const FieldCheck check{file};
  const FileHeader header = openHeader(start, file_bytes, check);
  checkShape(header, check);
  checkMap(header, check);
  checkValues(header, check);
  const std::size_t name_at = sizeof(FileHeader) + header.level_count * sizeof(LevelEntry);
  check(header.header_bytes == name_at + header.source_name_bytes, FIELD(header_bytes),
        "the sizes of its parts together");

  DecodedHeader decoded{.info = infoOf(header), .layout = {}};
  std::vector<LevelEntry> entries(header.level_count);
  std::memcpy(entries.data(), start.data() + sizeof header, entries.size() * sizeof(LevelEntry));
  const auto* name = reinterpret_cast<const char*>(start.data() + name_at);
  decoded.info.source_name.assign(name, header.source_name_bytes);
  if (!isPlainText(decoded.info.source_name)) {
    failData("{}: source name at offset {} must be UTF-8 without control characters", file, name_at);
  }
  for (std::size_t i = 0; i < entries.size(); ++i) {
    checkCounts(header, entries[i], static_cast<int>(i), check);
    LevelInfo& level = decoded.info.levels.emplace_back();
    level.dims = levelDims(decoded.info.dims, static_cast<int>(i));
    level.block_count = entries[i].block_count;
    level.subblock_count = entries[i].subblock_count;
    level.voxel_bytes = level.subblock_count * decoded.info.subblockVoxels() * voxelBytes(decoded.info.type);
  }
  decoded.layout = layOutFile(decoded.info);
  checkLayout(header, entries, decoded.layout, check);
  decoded.layout.levels = std::move(entries);
  return decoded;
}

}  // namespace blockwalk
