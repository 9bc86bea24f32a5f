// SPDX-License-Identifier: Apache-2.0
// What took work to read, kept while there is room: what was asked for last stays longest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

namespace blockwalk {

// Threads may call at the same time; two that ask for what is not there make it both.
class KeptBytes {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::byte>>;

  explicit KeptBytes(std::uint64_t memory_bytes) : memory_bytes_(memory_bytes) {}

  // What make() gave for this key, now or before.
  template <typename Make>
  Bytes get(std::uint64_t key, Make make) {
    if (Bytes known = find(key)) return known;
    Bytes made = make();
    keep(key, made);
    return made;
  }

 private:
  struct Kept {
    Bytes bytes;
    std::list<std::uint64_t>::iterator age;
  };

  Bytes find(std::uint64_t key);
  void keep(std::uint64_t key, const Bytes& bytes);

  std::uint64_t memory_bytes_;
  std::mutex mutex_;
  std::unordered_map<std::uint64_t, Kept> kept_;
  std::list<std::uint64_t> ages_;  // most recent first
  std::uint64_t kept_bytes_ = 0;
};

}  // namespace blockwalk
