// SPDX-License-Identifier: Apache-2.0
// Subblocks of level 0 on their way from the source's order to the file's: the first in memory, what does not fit there
// in a file that has no name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <span>

#include "volume/build/storage.h"

namespace blockwalk {

class Spill {
 public:
  // Slots of `slot_bytes`, in memory up to `memory_bytes`, which is taken as it is needed. `stream_bytes`: of the file.
  Spill(const std::filesystem::path& folder, std::size_t slot_bytes, std::uint64_t memory_bytes,
        std::size_t stream_bytes);
  ~Spill();
  Spill(const Spill&) = delete;
  Spill& operator=(const Spill&) = delete;

  // Appends those of the `slots` that `order` names, in that order; returns the number of the first. From several
  // threads at a time.
  std::uint64_t append(std::span<const std::byte> slots, std::span<const std::size_t> order);
  // Once all were appended, from several threads at a time: `count` slots where they lie in memory, else nothing.
  std::span<const std::byte> inMemory(std::uint64_t slot, std::uint64_t count) const;
  // And `out` from byte `offset` of all slots on.
  void read(std::uint64_t offset, std::span<std::byte> out) const;

 private:
  std::size_t slot_bytes_;
  std::span<std::byte> memory_;  // whole slots; empty where the system gives none
  std::mutex mutex_;             // of the two below
  std::uint64_t slots_ = 0;
  TempBytes file_;
};

}  // namespace blockwalk
