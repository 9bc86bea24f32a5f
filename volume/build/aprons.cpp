// SPDX-License-Identifier: Apache-2.0
#include "volume/build/aprons.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <list>
#include <type_traits>
#include <utility>

#include "volume/error.h"

namespace blockwalk {

LevelShells::LevelShells(const std::filesystem::path& folder, std::size_t stream_bytes, std::size_t cache_bytes)
    : shells_(folder, stream_bytes), blocks_(folder, stream_bytes), cache_bytes_(cache_bytes) {}

namespace {

struct StoredBlock {
  std::uint64_t code = 0;
  std::uint64_t first_subblock = 0;
  SubblockSet stored{};
};

glm::ivec3 direction(std::size_t part) {
  const auto d = static_cast<int>(part);
  return {d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1};
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
    for (int local = 0; local < side_ * side_ * side_; ++local) {
      if (!contains(stored, local)) continue;
      const glm::ivec3 p = step * side_ + glm::ivec3(local % side_, local / side_ % side_, local / (side_ * side_));
      const bool near =
          glm::all(glm::greaterThanEqual(p, glm::ivec3(-1))) && glm::all(glm::lessThanEqual(p, glm::ivec3(side_)));
      if (near) shells_[index(p)] = shells;
      shells += shell_bytes;
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

// Makes the records of one block at a time.
class ApronFinder {
 public:
  ApronFinder(const VolumeInfo& info, glm::ivec3 dims)
      : info_(info), part_bytes_(apronRangeBytes(info.type)), neighbourhood_(info, dims) {
    for (const ChannelInfo& channel : info.channels) {
      std::vector<std::byte> value;
      appendDensity(value, info.type, emptyValue(info.type, channel));
      empty_values_.push_back(value);
    }
    ranges_.resize(info.channels.size());
  }

  Neighbourhood& neighbourhood() { return neighbourhood_; }
  std::span<const std::byte> ranges(std::size_t channel) const { return ranges_[channel]; }

  // `stored` of the block at `origin`, whose neighbourhood is filled.
  BlockRecord find(glm::ivec3 origin, const SubblockSet& stored) {
    BlockRecord record{.origin = origin, .stored = stored, .beyond = {}};
    for (std::vector<std::byte>& ranges : ranges_) ranges.clear();
    const int side = info_.block_side;
    for (int local = 0; local < side * side * side; ++local) {
      const glm::ivec3 at(local % side, local / side % side, local / (side * side));
      if (!neighbourhood_.isInside(origin * side + at)) continue;
      if (!look(origin * side, at)) continue;
      const bool has_voxels = contains(stored, local);
      bool any = has_voxels;
      for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
        any = appendRangeOf(channel) || any;
      }
      if (!any) {
        for (std::vector<std::byte>& ranges : ranges_) ranges.resize(ranges.size() - part_bytes_);
      } else if (!has_voxels) {
        insert(record.beyond, local);
      }
    }
    return record;
  }

 private:
  // The parts of shells that lie in or around the subblock; false when there are none.
  bool look(glm::ivec3 first, glm::ivec3 at) {
    parts_.clear();
    beside_empty_ = false;
    for (std::size_t d = 0; d < kShellParts; ++d) {
      const glm::ivec3 other = at + direction(d);
      const std::byte* shell = neighbourhood_.at(other);
      if (shell != nullptr) {
        // As seen from there, this subblock lies the other way.
        parts_.push_back(shell + (kShellParts - 1 - d) * part_bytes_);
      } else if (!beside_empty_) {
        beside_empty_ = neighbourhood_.isInside(first + other);
      }
    }
    return !parts_.empty();
  }

  template <typename T>
  bool appendRangeAs(std::size_t channel) {
    T least{};
    T greatest{};
    std::memcpy(&least, empty_values_[channel].data(), sizeof(T));
    greatest = least;
    bool first = !beside_empty_;
    const std::size_t offset = channel * kShellParts * part_bytes_;
    for (const std::byte* part : parts_) {
      std::array<T, 2> range;
      std::memcpy(range.data(), part + offset, sizeof range);
      least = first ? range[0] : std::min(least, range[0]);
      greatest = first ? range[1] : std::max(greatest, range[1]);
      first = false;
    }
    const std::array<T, 2> range{least, greatest};
    const auto* bytes = reinterpret_cast<const std::byte*>(range.data());
    ranges_[channel].insert(ranges_[channel].end(), bytes, bytes + sizeof range);
    return static_cast<float>(greatest) > info_.channels[channel].empty_threshold;
  }

  // True where the channel is not empty there.
  bool appendRangeOf(std::size_t channel) {
    switch (info_.type) {
      case VoxelType::u8:
      case VoxelType::rgba8:
        return appendRangeAs<std::uint8_t>(channel);
      case VoxelType::u16:
        return appendRangeAs<std::uint16_t>(channel);
      case VoxelType::f32:
        return appendRangeAs<float>(channel);
    }
    return false;
  }

  const VolumeInfo& info_;
  std::size_t part_bytes_;
  Neighbourhood neighbourhood_;
  std::vector<std::vector<std::byte>> empty_values_;  // by channel
  std::vector<std::vector<std::byte>> ranges_;        // of the block, by channel
  std::vector<const std::byte*> parts_;
  bool beside_empty_ = false;
};

// The blocks around stored ones that are not stored themselves, as Morton codes, ascending: candidates, of which some
// have no apron that is not empty.
std::vector<std::uint64_t> blocksAround(std::span<const StoredBlock> stored, const VolumeInfo& info, glm::ivec3 dims) {
  const glm::ivec3 blocks = (dims + info.blockVoxels() - 1) / info.blockVoxels();
  const auto isStored = [&](std::uint64_t code) {
    const auto found = std::ranges::lower_bound(stored, code, {}, &StoredBlock::code);
    return found != stored.end() && found->code == code;
  };
  std::vector<std::uint64_t> codes;
  std::size_t settled = 0;  // of codes, ascending
  const auto settle = [&] {
    std::ranges::sort(codes);
    codes.erase(std::unique(codes.begin(), codes.end()), codes.end());
    settled = codes.size();
  };
  for (const StoredBlock& block : stored) {
    const glm::ivec3 origin = mortonPosition(block.code);
    const SubblockSet inside = insideMask(info, dims, origin);
    for (std::size_t d = 0; d < kShellParts; ++d) {
      const glm::ivec3 other = origin + direction(d);
      if (d == kShellParts / 2 || glm::any(glm::lessThan(other, glm::ivec3(0))) ||
          glm::any(glm::greaterThanEqual(other, blocks)))
        continue;
      // Only what has a subblock on that side can reach there.
      bool reaches = false;
      for (int local = 0; local < info.block_side * info.block_side * info.block_side && !reaches; ++local) {
        if (!contains(block.stored, local) || !contains(inside, local)) continue;
        const glm::ivec3 at(local % info.block_side, local / info.block_side % info.block_side,
                            local / (info.block_side * info.block_side));
        const glm::ivec3 step = direction(d);
        reaches = true;
        for (int axis = 0; axis < 3; ++axis) {
          if (step[axis] < 0 && at[axis] != 0) reaches = false;
          if (step[axis] > 0 && at[axis] != info.block_side - 1) reaches = false;
        }
      }
      const std::uint64_t code = reaches ? mortonCode(glm::uvec3(other)) : 0;
      if (reaches && !isStored(code)) codes.push_back(code);
    }
    if (codes.size() > 2 * settled + 65536) settle();
  }
  settle();
  return codes;
}

}  // namespace

void LevelShells::addBlock(glm::ivec3 origin, const SubblockSet& stored) {
  const StoredBlock block{.code = mortonCode(glm::uvec3(origin)), .first_subblock = subblocks_, .stored = stored};
  blocks_.append(std::as_bytes(std::span(&block, 1)));
  subblocks_ += static_cast<std::uint64_t>(countOf(stored));
}

LevelShells::Aprons LevelShells::find(const VolumeInfo& info, glm::ivec3 dims, TempBytes& blocks,
                                      std::span<TempBytes* const> apron_ranges) {
  std::vector<StoredBlock> stored(static_cast<std::size_t>(blocks_.size() / sizeof(StoredBlock)));
  blocks_.read(0, std::as_writable_bytes(std::span(stored)));
  std::unordered_map<std::uint64_t, std::size_t> places;
  places.reserve(stored.size());
  for (std::size_t i = 0; i < stored.size(); ++i) places.emplace(stored[i].code, i);
  const std::vector<std::uint64_t> around = blocksAround(stored, info, dims);

  const std::size_t shell_bytes = info.channels.size() * kShellParts * apronRangeBytes(info.type);
  ShellCache cache(shells_, shell_bytes, cache_bytes_);
  ApronFinder finder(info, dims);
  Aprons aprons;
  std::vector<std::byte> record;
  const auto findOne = [&](std::uint64_t code, const SubblockSet& own) {
    const glm::ivec3 origin = mortonPosition(code);
    finder.neighbourhood().clear();
    for (std::size_t d = 0; d < kShellParts; ++d) {
      const glm::ivec3 other = origin + direction(d);
      if (glm::any(glm::lessThan(other, glm::ivec3(0)))) continue;
      const auto place = places.find(mortonCode(glm::uvec3(other)));
      if (place == places.end()) continue;
      const StoredBlock& block = stored[place->second];
      finder.neighbourhood().add(direction(d), block.stored, cache.of(block), shell_bytes);
    }
    const BlockRecord found = finder.find(origin, own);
    const int count = countOf(found.stored) + countOf(found.beyond);
    if (count == 0) return;
    record.clear();
    appendBlockRecord(record, info.block_side, found);
    blocks.append(record);
    for (std::size_t channel = 0; channel < apron_ranges.size(); ++channel) {
      apron_ranges[channel]->append(finder.ranges(channel));
    }
    ++aprons.blocks;
    aprons.subblocks += static_cast<std::uint64_t>(count);
  };
  auto next = around.begin();
  for (const StoredBlock& block : stored) {
    for (; next != around.end() && *next < block.code; ++next) findOne(*next, {});
    findOne(block.code, block.stored);
  }
  for (; next != around.end(); ++next) findOne(*next, {});
  return aprons;
}

}  // namespace blockwalk
