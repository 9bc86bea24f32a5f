// SPDX-License-Identifier: Apache-2.0
#include "volume/build/sort.h"

#include <algorithm>
#include <span>

#include "volume/error.h"

namespace blockwalk {

RecordSorter::RecordSorter(std::filesystem::path folder, std::uint64_t memory_bytes)
    : capacity_(std::max<std::size_t>(16, static_cast<std::size_t>(memory_bytes / sizeof(SubblockRecord)))),
      stored_(std::move(folder), 0) {}

void RecordSorter::add(const SubblockRecord& record) {
  if (buffer_.size() == capacity_) storeRun();
  buffer_.push_back(record);
  ++count_;
}

void RecordSorter::storeRun() {
  std::ranges::sort(buffer_, {}, &SubblockRecord::key);
  Run run;
  run.next = stored_.size() / sizeof(SubblockRecord);
  run.end = run.next + buffer_.size();
  stored_.append(std::as_bytes(std::span(buffer_)));
  runs_.push_back(std::move(run));
  buffer_.clear();
}

void RecordSorter::finish() {
  if (runs_.empty()) {
    std::ranges::sort(buffer_, {}, &SubblockRecord::key);
    return;
  }
  if (!buffer_.empty()) storeRun();
  std::vector<SubblockRecord>().swap(buffer_);
  window_records_ = std::max<std::size_t>(4, capacity_ / runs_.size());
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    if (refill(runs_[i])) heads_.emplace(runs_[i].window.front().key, i);
  }
}

bool RecordSorter::refill(Run& run) {
  const std::uint64_t records = std::min<std::uint64_t>(window_records_, run.end - run.next);
  run.window.resize(static_cast<std::size_t>(records));
  run.at = 0;
  stored_.read(run.next * sizeof(SubblockRecord), std::as_writable_bytes(std::span(run.window)));
  run.next += records;
  return records > 0;
}

bool RecordSorter::next(SubblockRecord& record) {
  if (runs_.empty()) {
    if (at_ == buffer_.size()) return false;
    record = buffer_[at_++];
    return true;
  }
  if (heads_.empty()) return false;
  const std::size_t index = heads_.top().second;
  heads_.pop();
  Run& run = runs_[index];
  record = run.window[run.at++];
  if (run.at < run.window.size() || refill(run)) heads_.emplace(run.window[run.at].key, index);
  return true;
}

}  // namespace blockwalk
