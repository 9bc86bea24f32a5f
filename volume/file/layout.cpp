// SPDX-License-Identifier: Apache-2.0
#include "volume/file/layout.h"

#include <algorithm>
#include <cstring>

#include "volume/error.h"
#include "volume/file/plain_bytes.h"

namespace blockwalk {
namespace {

float takeDensity(const std::byte*& at, VoxelType type) {
  switch (densityBytes(type)) {
    case 1:
      return static_cast<float>(takePlain<std::uint8_t>(at));
    case 2:
      return static_cast<float>(takePlain<std::uint16_t>(at));
    default:
      return takePlain<float>(at);
  }
}

std::size_t occupancyBytes(int block_side) {
  return (static_cast<std::size_t>(block_side * block_side * block_side) + 7) / 8;
}

void appendSet(std::vector<std::byte>& out, int block_side, const SubblockSet& set) {
  if (static_cast<std::size_t>(countOf(set)) < occupancyBytes(block_side)) {
    for (int local = 0; local < block_side * block_side * block_side; ++local) {
      if (contains(set, local)) appendPlain(out, static_cast<std::uint8_t>(local));
    }
    return;
  }
  const auto* bits = reinterpret_cast<const std::byte*>(set.data());
  out.insert(out.end(), bits, bits + occupancyBytes(block_side));
}

bool takeSet(std::span<const std::byte>& records, int block_side, std::size_t count, SubblockSet& set) {
  const std::size_t as_bits = occupancyBytes(block_side);
  if (records.size() < std::min(count, as_bits)) return false;
  if (count >= as_bits) {
    std::memcpy(set.data(), records.data(), as_bits);
    records = records.subspan(as_bits);
    return static_cast<std::size_t>(countOf(set)) == count;
  }
  int last = -1;
  for (std::size_t i = 0; i < count; ++i) {
    const int local = std::to_integer<std::uint8_t>(records[i]);
    if (local <= last || local >= block_side * block_side * block_side) return false;
    insert(set, local);
    last = local;
  }
  records = records.subspan(count);
  return true;
}

}  // namespace

std::size_t densityBytes(VoxelType type) { return type == VoxelType::rgba8 ? 1 : voxelBytes(type); }
std::size_t rangeBytes(VoxelType type) { return 2 * densityBytes(type) + 1; }
std::size_t apronRangeBytes(VoxelType type) { return 2 * densityBytes(type); }
std::size_t largestBlockRecordBytes(int block_side) { return 3 * 2 + 1 + 1 + 2 * occupancyBytes(block_side); }

std::uint64_t indexBytes(std::uint64_t records, std::size_t channels) {
  if (records <= kGroupRecords) return 0;
  const std::uint64_t groups = (records + kGroupRecords - 1) / kGroupRecords;
  return groups * (sizeof(IndexGroup) + channels * sizeof(IndexPart)) + sizeof(std::uint64_t);
}

void appendDensity(std::vector<std::byte>& out, VoxelType type, float density) {
  switch (densityBytes(type)) {
    case 1:
      appendPlain(out, static_cast<std::uint8_t>(density));
      break;
    case 2:
      appendPlain(out, static_cast<std::uint16_t>(density));
      break;
    default:
      appendPlain(out, density);
  }
}

void appendBlockRecord(std::vector<std::byte>& out, int block_side, const BlockRecord& record) {
  for (int axis = 0; axis < 3; ++axis) appendPlain(out, static_cast<std::uint16_t>(record.origin[axis]));
  appendPlain(out, static_cast<std::uint8_t>(countOf(record.stored)));
  appendPlain(out, static_cast<std::uint8_t>(countOf(record.beyond)));
  appendSet(out, block_side, record.stored);
  appendSet(out, block_side, record.beyond);
}

void appendRange(std::vector<std::byte>& out, VoxelType type, const Subblock& subblock) {
  appendDensity(out, type, subblock.density_min);
  appendDensity(out, type, subblock.density_max);
  appendPlain(out, subblock.range_mask);
}

bool takeBlockRecord(std::span<const std::byte>& records, int block_side, BlockRecord& record) {
  constexpr std::size_t kFixed = 3 * 2 + 1 + 1;
  if (records.size() < kFixed) return false;
  const std::byte* at = records.data();
  for (int axis = 0; axis < 3; ++axis) record.origin[axis] = takePlain<std::uint16_t>(at);
  const std::size_t stored = takePlain<std::uint8_t>(at);
  const std::size_t beyond = takePlain<std::uint8_t>(at);
  records = records.subspan(kFixed);
  record.stored = {};
  record.beyond = {};
  return stored + beyond > 0 && takeSet(records, block_side, stored, record.stored) &&
         takeSet(records, block_side, beyond, record.beyond);
}

Subblock decodeRange(const std::byte* record, VoxelType type) {
  Subblock subblock;
  subblock.density_min = takeDensity(record, type);
  subblock.density_max = takeDensity(record, type);
  subblock.range_mask = takePlain<std::uint8_t>(record);
  return subblock;
}

Subblock decodeApronRange(const std::byte* record, VoxelType type) {
  Subblock subblock;
  subblock.density_min = takeDensity(record, type);
  subblock.density_max = takeDensity(record, type);
  return subblock;
}

SubblockSet insideMask(const VolumeInfo& info, glm::ivec3 level_dims, glm::ivec3 origin) {
  SubblockSet mask{};
  const glm::ivec3 rest = level_dims - origin * info.blockVoxels();
  const glm::ivec3 inside = glm::min((rest + info.subblock_side - 1) / info.subblock_side, glm::ivec3(info.block_side));
  for (int z = 0; z < inside.z; ++z) {
    for (int y = 0; y < inside.y; ++y) {
      for (int x = 0; x < inside.x; ++x) {
        insert(mask, x + info.block_side * (y + info.block_side * z));
      }
    }
  }
  return mask;
}

Section placeSection(std::uint64_t& end, std::uint64_t bytes) {
  const std::uint64_t offset = (end + kSectionAlignment - 1) / kSectionAlignment * kSectionAlignment;
  end = offset + bytes;
  return {.offset = offset, .bytes = bytes, .checksum = 0};
}

std::vector<std::size_t> fileOrder(const VolumeInfo& info) {
  std::vector<std::size_t> order;
  for (int level = static_cast<int>(info.levels.size()) - 1; level >= 0; --level) {
    for (const Form form : {Form::values, Form::maxima}) {
      if (info.has(level, form)) order.push_back(entryIndex(info, level, form));
    }
  }
  return order;
}

FileLayout layOutFile(const VolumeInfo& info, const FileSizes& sizes) {
  BLOCKWALK_CHECK(info.levels.empty(), ==, false);
  const std::size_t channels = info.channels.size();
  const std::size_t entries = info.levels.size() + info.maxima.size();
  BLOCKWALK_CHECK(sizes.blocks.size(), ==, entries);
  BLOCKWALK_CHECK(sizes.voxels.size(), ==, entries * channels);
  FileLayout layout;
  layout.channels = channels;
  layout.group_records = sizes.group_records;
  layout.entries.resize(entries);
  layout.indices.resize(entries);
  layout.sections.resize(entries * channels);
  layout.header_bytes = static_cast<std::uint32_t>(sizeof(FileHeader) + entries * sizeof(LevelEntry) +
                                                   layout.sections.size() * sizeof(ChannelSections) +
                                                   channels * sizeof(ChannelEntry) + sizes.metadata);
  std::uint64_t end = layout.header_bytes;
  const std::vector<std::size_t> order = fileOrder(info);
  for (const std::size_t i : order) {
    const EntryPlace place = entryPlace(i, info.levels.size());
    const LevelInfo& level = info.level(place.level, place.form);
    const glm::ivec3 dims = levelDims(info.dims, place.level);
    LevelEntry& entry = layout.entries[i];
    for (int axis = 0; axis < 3; ++axis) {
      entry.dims[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(dims[axis]);
    }
    entry.block_count = level.block_count;
    entry.subblock_count = level.subblock_count;
    entry.apron_block_count = level.apron_block_count;
    entry.apron_subblock_count = level.apron_subblock_count;
    entry.blocks = placeSection(end, sizes.blocks[i]);
    const std::uint64_t index_bytes = sizes.group_records == 0 ? 0 : indexBytes(entry.apron_block_count, channels);
    if (index_bytes > 0) layout.indices[i] = placeSection(end, index_bytes);
    for (std::size_t channel = 0; channel < channels; ++channel) {
      ChannelSections& sections = layout.of(i, channel);
      sections.ranges = placeSection(end, level.subblock_count * rangeBytes(info.type));
      sections.apron_ranges = placeSection(end, level.apron_subblock_count * apronRangeBytes(info.type));
      sections.pages = placeSection(end, level.block_count * sizeof(PageEntry));
    }
  }
  for (const std::size_t i : order) {
    for (std::size_t channel = 0; channel < channels; ++channel) {
      layout.of(i, channel).voxels = placeSection(end, sizes.voxels[i * channels + channel]);
    }
  }
  layout.file_bytes = end;
  return layout;
}

}  // namespace blockwalk
