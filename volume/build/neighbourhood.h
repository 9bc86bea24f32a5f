// SPDX-License-Identifier: Apache-2.0
// The shells around one block while its aprons are found.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <list>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "volume/build/shell.h"
#include "volume/build/storage.h"
#include "volume/file/layout.h"

namespace blockwalk {

struct StoredBlock {
  std::uint64_t code = 0;
  std::uint64_t first_subblock = 0;
  SubblockSet stored{};
};

inline glm::ivec3 direction(std::size_t part) {
  static const auto kDirections = [] {
    std::array<glm::ivec3, kShellParts> all;
    for (int d = 0; d < static_cast<int>(kShellParts); ++d) {
      all[static_cast<std::size_t>(d)] = {d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1};
    }
    return all;
  }();
  return kDirections[part];
}

// Whole blocks' shells, the latest in memory.
class ShellCache {
 public:
  ShellCache(const TempBytes& shells, std::size_t shell_bytes, std::size_t cache_bytes)
      : shells_(shells), shell_bytes_(shell_bytes), cache_bytes_(cache_bytes) {}

  // Valid until 27 other blocks were asked for.
  const std::byte* of(const StoredBlock& block) {
    const auto known = cache_.find(block.code);
    if (known != cache_.end()) {
      ages_.splice(ages_.begin(), ages_, known->second.age);
      return known->second.bytes.data();
    }
    std::vector<std::byte> bytes(static_cast<std::size_t>(countOf(block.stored)) * shell_bytes_);
    shells_.read(block.first_subblock * shell_bytes_, bytes);
    cached_bytes_ += bytes.size();
    while (cached_bytes_ > cache_bytes_ && ages_.size() > kShellParts) {
      const auto oldest = cache_.find(ages_.back());
      cached_bytes_ -= oldest->second.bytes.size();
      cache_.erase(oldest);
      ages_.pop_back();
    }
    ages_.push_front(block.code);
    return cache_.emplace(block.code, Entry{.bytes = std::move(bytes), .age = ages_.begin()})
        .first->second.bytes.data();
  }

 private:
  struct Entry {
    std::vector<std::byte> bytes;
    std::list<std::uint64_t>::iterator age;
  };
  const TempBytes& shells_;
  std::size_t shell_bytes_;
  std::size_t cache_bytes_;
  std::uint64_t cached_bytes_ = 0;
  std::unordered_map<std::uint64_t, Entry> cache_;
  std::list<std::uint64_t> ages_;  // latest first
};

// How many of a block's stored subblocks come before one.
class Ranks {
 public:
  explicit Ranks(const SubblockSet& stored) : stored_(stored) {
    for (std::size_t word = 1; word < stored.size(); ++word) {
      before_[word] = before_[word - 1] + std::popcount(stored[word - 1]);
    }
  }
  int of(int local) const {
    const auto word = static_cast<std::size_t>(local / 64);
    const std::uint64_t below = (std::uint64_t{1} << (local % 64)) - 1;
    return before_[word] + std::popcount(stored_[word] & below);
  }

 private:
  const SubblockSet& stored_;
  std::array<int, std::tuple_size_v<SubblockSet>> before_{};
};

// The subblocks of a block and one more on each side, as shells of every channel.
class Neighbourhood {
 public:
  Neighbourhood(const VolumeInfo& info, glm::ivec3 dims)
      : side_(info.block_side), subblock_dims_((dims + info.subblock_side - 1) / info.subblock_side) {
    shells_.resize(static_cast<std::size_t>((side_ + 2) * (side_ + 2) * (side_ + 2)));
  }

  void clear() { std::ranges::fill(shells_, nullptr); }

  // Takes what lies around the block at `origin` from a block whose origin is by `step` blocks from it.
  void add(glm::ivec3 step, const SubblockSet& stored, const std::byte* shells, std::size_t shell_bytes) {
    const Ranks ranks(stored);
    glm::ivec3 first(0);
    glm::ivec3 last(side_ - 1);
    for (int axis = 0; axis < 3; ++axis) {
      if (step[axis] < 0) first[axis] = side_ - 1;
      if (step[axis] > 0) last[axis] = 0;
    }
    for (int z = first.z; z <= last.z; ++z) {
      for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
          const int local = x + side_ * (y + side_ * z);
          if (!contains(stored, local)) continue;
          shells_[index(step * side_ + glm::ivec3(x, y, z))] =
              shells + static_cast<std::size_t>(ranks.of(local)) * shell_bytes;
        }
      }
    }
  }

  const std::byte* at(glm::ivec3 local) const { return shells_[index(local)]; }
  bool isInside(glm::ivec3 subblock) const {
    return glm::all(glm::greaterThanEqual(subblock, glm::ivec3(0))) &&
           glm::all(glm::lessThan(subblock, subblock_dims_));
  }

 private:
  std::size_t index(glm::ivec3 p) const {
    const int side = side_ + 2;
    return static_cast<std::size_t>(p.x + 1 + side * (p.y + 1 + side * (p.z + 1)));
  }

  int side_;
  glm::ivec3 subblock_dims_;  // of the level
  std::vector<const std::byte*> shells_;
};

}  // namespace blockwalk
