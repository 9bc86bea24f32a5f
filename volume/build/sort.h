// SPDX-License-Identifier: Apache-2.0
// Sorts the records of level 0's subblocks in bounded memory: sorted runs in a temporary file, then one merge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <queue>
#include <utility>
#include <vector>

#include "volume/build/storage.h"

namespace blockwalk {

// Where one subblock's voxels are. The key is Morton code of the block << 8 | local subblock index, so that ascending
// keys are the file's order.
struct SubblockRecord {
  std::uint64_t key = 0;
  std::uint64_t slot = 0;  // in the spill; or kConstantSlot | where the constants hold the value of every voxel
};
constexpr std::uint64_t kConstantSlot = std::uint64_t{1} << 63;

class RecordSorter {
 public:
  // Holds about `memory_bytes` of records at a time, at least 16 records.
  RecordSorter(std::filesystem::path folder, std::uint64_t memory_bytes);

  void add(const SubblockRecord& record);
  std::uint64_t count() const { return count_; }
  std::size_t runCount() const { return runs_.size(); }

  // After the last add: the records in ascending order of key. next() is false at the end.
  void finish();
  bool next(SubblockRecord& record);

 private:
  struct Run {
    std::uint64_t next = 0;  // record index in stored_
    std::uint64_t end = 0;
    std::vector<SubblockRecord> window;
    std::size_t at = 0;
  };
  void storeRun();
  bool refill(Run& run);

  std::size_t capacity_;  // records
  std::vector<SubblockRecord> buffer_;
  std::size_t at_ = 0;  // in buffer_, when there are no runs
  TempBytes stored_;
  std::vector<Run> runs_;
  std::size_t window_records_ = 0;
  using Head = std::pair<std::uint64_t, std::size_t>;  // key, run
  std::priority_queue<Head, std::vector<Head>, std::greater<>> heads_;
  std::uint64_t count_ = 0;
};

}  // namespace blockwalk
