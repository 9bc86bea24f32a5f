// SPDX-License-Identifier: Apache-2.0
// How many threads may unpack a chunk at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <semaphore>

namespace blockwalk {

class UnpackingRoom {
 public:
  // As many as there is memory for, of which each takes `each_bytes`; one at least.
  UnpackingRoom(std::uint64_t each_bytes, std::uint64_t memory_bytes)
      : free_(static_cast<std::ptrdiff_t>(std::clamp<std::uint64_t>(memory_bytes / each_bytes, 1, 256))) {}

  // Gives back what it took, however that ends.
  class Taken {
   public:
    explicit Taken(UnpackingRoom& room) : room_(room) { room_.free_.acquire(); }
    ~Taken() { room_.free_.release(); }
    Taken(const Taken&) = delete;
    Taken& operator=(const Taken&) = delete;

   private:
    UnpackingRoom& room_;
  };

 private:
  std::counting_semaphore<> free_;
};

}  // namespace blockwalk
