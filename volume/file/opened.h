// SPDX-License-Identifier: Apache-2.0
// What an open file keeps, and how records and tables of it are read when they are first asked for.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "volume/file/file.h"
#include "volume/file/file_content.h"
#include "volume/file/header.h"
#include "volume/file/lazy.h"
#include "volume/file/page_table.h"
#include "volume/file/record_index.h"
#include "volume/file/records.h"
#include "volume/file/steps.h"

namespace blockwalk {

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
  // visit(reader of the records, group) of each, ascending.
  template <typename Visit>
  void forEachGroup(const RecordPlace& at, std::span<const std::size_t> met, Visit visit) const;
  void checkFirstRecord(const RecordPlace& at, const RecordGroup& group) const;
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

}  // namespace blockwalk
