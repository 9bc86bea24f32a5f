// SPDX-License-Identifier: Apache-2.0
// What took work to read, kept while there is room: what was asked for last stays longest.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace blockwalk {

// Threads may call at the same time; of several that ask for what is not there one makes it, and the others wait.
class KeptBytes {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::byte>>;

  explicit KeptBytes(std::uint64_t memory_bytes) : memory_bytes_(memory_bytes) {}

  // What make() gave for this key, now or before; null is not kept. make() must not ask for another key of the same.
  template <typename Make>
  Bytes get(std::uint64_t key, Make make) {
    if (Bytes known = findOrBegin(key)) return known;
    const Making making(*this, key);
    Bytes made = make();
    if (made) keep(key, made);
    return made;
  }

 private:
  struct Kept {
    Bytes bytes;
    std::list<std::uint64_t>::iterator age;
  };
  // Until its end the key is being made, however that ends.
  class Making {
   public:
    Making(KeptBytes& kept, std::uint64_t key) : kept_(kept), key_(key) {}
    ~Making() { kept_.end(key_); }
    Making(const Making&) = delete;
    Making& operator=(const Making&) = delete;

   private:
    KeptBytes& kept_;
    std::uint64_t key_;
  };

  // Null: the caller is who makes it.
  Bytes findOrBegin(std::uint64_t key);
  void keep(std::uint64_t key, const Bytes& bytes);
  void end(std::uint64_t key);

  std::uint64_t memory_bytes_;
  std::mutex mutex_;
  std::condition_variable ended_;
  std::unordered_set<std::uint64_t> being_made_;
  std::unordered_map<std::uint64_t, Kept> kept_;
  std::list<std::uint64_t> ages_;  // most recent first
  std::uint64_t kept_bytes_ = 0;
};

}  // namespace blockwalk
