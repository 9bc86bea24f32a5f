// SPDX-License-Identifier: Apache-2.0
// Makes the checksums of a .bwv file right after it was changed on purpose, so that readers judge the change itself.
#pragma once

#include <algorithm>
#include <cstring>
#include <span>
#include <string>

#include "volume/file/checksum.h"
#include "volume/file/header.h"

namespace blockwalk::volume_test {

template <typename T>
T valueAt(std::span<const std::byte> bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

template <typename T>
void putAt(std::span<std::byte> bytes, std::size_t offset, const T& value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

inline bool liesInside(std::span<const std::byte> bytes, const Section& section) {
  return section.offset <= bytes.size() && section.bytes <= bytes.size() - section.offset;
}

// The checksums of a channel's pages, one after the other as long as they lie inside the bytes.
inline void sealPages(std::span<std::byte> bytes, const ChannelSections& sections) {
  if (!liesInside(bytes, sections.pages)) return;
  std::uint64_t at = sections.voxels.offset;
  for (std::uint64_t page = 0; page + sizeof(PageEntry) <= sections.pages.bytes; page += sizeof(PageEntry)) {
    auto entry = valueAt<PageEntry>(bytes, sections.pages.offset + page);
    if (!liesInside(bytes, {.offset = at, .bytes = entry.bytes})) return;
    entry.checksum = checksumOf(bytes.subspan(at, entry.bytes));
    putAt(bytes, sections.pages.offset + page, entry);
    at += entry.bytes;
  }
}

// A level's index, where it has one: its checksum is its last word.
inline Section indexOf(std::span<const std::byte> bytes, const LevelEntry& entry) {
  const auto header = valueAt<FileHeader>(bytes, 0);
  if (header.group_records == 0) return {};
  std::uint64_t end = entry.blocks.offset + entry.blocks.bytes;
  return placeSection(end, indexBytes(entry.apron_block_count, header.channel_count));
}

inline void sealIndex(std::span<std::byte> bytes, const LevelEntry& entry) {
  const Section section = indexOf(bytes, entry);
  if (section.bytes == 0 || !liesInside(bytes, section)) return;
  const std::uint64_t records = section.bytes - sizeof(std::uint64_t);
  putAt(bytes, section.offset + records, checksumOf(bytes.subspan(section.offset, records)));
}

// The header's own checksum alone.
inline void sealHeader(std::span<std::byte> bytes) {
  auto header = valueAt<FileHeader>(bytes, 0);
  header.header_checksum = 0;
  putAt(bytes, 0, header);
  header.header_checksum = checksumOf(bytes.first(std::min<std::size_t>(header.header_bytes, bytes.size())));
  putAt(bytes, 0, header);
}

// Every checksum whose section lies inside the bytes, and the header's.
inline void seal(std::span<std::byte> bytes) {
  if (bytes.size() < sizeof(FileHeader)) return;
  const auto header = valueAt<FileHeader>(bytes, 0);
  const std::size_t levels =
      std::min<std::size_t>(header.level_count, kMaxLevels) + std::min<std::size_t>(header.maxima_count, kMaxLevels);
  const std::size_t channels = std::min<std::size_t>(header.channel_count, kMaxChannels);
  const auto sealSection = [&](Section& section) {
    if (liesInside(bytes, section)) section.checksum = checksumOf(bytes.subspan(section.offset, section.bytes));
  };
  std::size_t at = sizeof header;
  for (std::size_t i = 0; i < levels && at + sizeof(LevelEntry) <= bytes.size(); ++i, at += sizeof(LevelEntry)) {
    auto entry = valueAt<LevelEntry>(bytes, at);
    sealSection(entry.blocks);
    sealIndex(bytes, entry);
    putAt(bytes, at, entry);
  }
  for (std::size_t i = 0; i < levels * channels && at + sizeof(ChannelSections) <= bytes.size();
       ++i, at += sizeof(ChannelSections)) {
    auto sections = valueAt<ChannelSections>(bytes, at);
    sealPages(bytes, sections);
    for (Section* section : {&sections.ranges, &sections.apron_ranges, &sections.pages}) sealSection(*section);
    putAt(bytes, at, sections);
  }
  sealHeader(bytes);
}

inline void seal(std::string& bytes) { seal(std::as_writable_bytes(std::span(bytes))); }
inline void sealHeader(std::string& bytes) { sealHeader(std::as_writable_bytes(std::span(bytes))); }
template <typename T>
T valueAt(const std::string& bytes, std::size_t offset) {
  return valueAt<T>(std::as_bytes(std::span(bytes)), offset);
}
template <typename T>
std::string raw(const T& value) {
  return std::string(reinterpret_cast<const char*>(&value), sizeof value);
}

// Where the parts of the header begin. An entry is a level's values, or behind them all a level's maxima.
inline std::size_t entryCount(const std::string& bytes) {
  const auto header = valueAt<FileHeader>(bytes, 0);
  return std::size_t{header.level_count} + header.maxima_count;
}
inline std::size_t levelEntryAt(std::size_t entry) { return sizeof(FileHeader) + entry * sizeof(LevelEntry); }
inline std::size_t sectionsAt(const std::string& bytes, std::size_t entry, std::size_t channel) {
  const auto header = valueAt<FileHeader>(bytes, 0);
  return levelEntryAt(entryCount(bytes)) + (entry * header.channel_count + channel) * sizeof(ChannelSections);
}
inline std::size_t channelEntryAt(const std::string& bytes, std::size_t channel) {
  return sectionsAt(bytes, entryCount(bytes), 0) + channel * sizeof(ChannelEntry);
}
inline std::size_t metadataAt(const std::string& bytes) {
  return channelEntryAt(bytes, valueAt<FileHeader>(bytes, 0).channel_count);
}

// Whether a byte of a right file lies between sections, where any value is read over.
inline bool isPadding(const std::string& bytes, std::size_t at) {
  const auto header = valueAt<FileHeader>(bytes, 0);
  if (at < header.header_bytes) return false;
  const auto holds = [at](const Section& section) {
    return at >= section.offset && at - section.offset < section.bytes;
  };
  for (std::size_t level = 0; level < entryCount(bytes); ++level) {
    const auto entry = valueAt<LevelEntry>(bytes, levelEntryAt(level));
    if (holds(entry.blocks) || holds(indexOf(std::as_bytes(std::span(bytes)), entry))) return false;
    for (std::size_t channel = 0; channel < header.channel_count; ++channel) {
      const auto of = valueAt<ChannelSections>(bytes, sectionsAt(bytes, level, channel));
      for (const Section& section : {of.ranges, of.apron_ranges, of.pages, of.voxels}) {
        if (holds(section)) return false;
      }
    }
  }
  return true;
}

}  // namespace blockwalk::volume_test
