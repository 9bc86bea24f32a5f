// SPDX-License-Identifier: Apache-2.0
#include "volume/build/aprons.h"

#include <algorithm>
#include <cstring>
#include <unordered_map>
#include <utility>

#include "volume/build/neighbourhood.h"
#include "volume/error.h"

namespace blockwalk {

LevelShells::LevelShells(const std::filesystem::path& folder, std::size_t stream_bytes, std::size_t cache_bytes)
    : shells_(folder, stream_bytes), blocks_(folder, stream_bytes), cache_bytes_(cache_bytes) {}

namespace {

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
    glm::ivec3 at(-1, 0, 0);
    for (int local = 0; local < side * side * side; ++local) {
      if (++at.x == side) at = at.y + 1 < side ? glm::ivec3(0, at.y + 1, at.z) : glm::ivec3(0, 0, at.z + 1);
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
      const std::uint64_t code = mortonCode(glm::uvec3(other));
      if (isStored(code)) continue;
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
      if (reaches) codes.push_back(code);
    }
    if (codes.size() > 2 * settled + 65536) settle();
  }
  settle();
  return codes;
}

constexpr std::size_t kJobBlocks = 128;  // in a job; what lies around them is read for each job

// The shells of a level, and what is known of it.
struct AllShells {
  const VolumeInfo& info;
  glm::ivec3 dims;
  std::span<const StoredBlock> stored;
  const TempBytes& shells;
  std::size_t shell_bytes;  // of a subblock
  std::size_t cache_bytes;  // of a job
};

// A block that has subblocks, or that lies around some.
struct WantedAprons {
  std::uint64_t code = 0;
  SubblockSet stored{};
};

// Of several blocks, as the file holds them.
struct FoundAprons {
  std::uint64_t blocks = 0;
  std::uint64_t subblocks = 0;
  std::vector<std::byte> records;
  std::vector<std::vector<std::byte>> ranges;  // by channel
};

FoundAprons findAprons(const AllShells& all, const std::unordered_map<std::uint64_t, std::size_t>& places,
                       std::span<const WantedAprons> run) {
  FoundAprons aprons;
  ShellCache cache(all.shells, all.shell_bytes, all.cache_bytes);
  aprons.ranges.resize(all.info.channels.size());
  ApronFinder finder(all.info, all.dims);
  for (const WantedAprons& wanted : run) {
    const glm::ivec3 origin = mortonPosition(wanted.code);
    finder.neighbourhood().clear();
    for (std::size_t d = 0; d < kShellParts; ++d) {
      const glm::ivec3 other = origin + direction(d);
      if (glm::any(glm::lessThan(other, glm::ivec3(0)))) continue;
      const auto place = places.find(mortonCode(glm::uvec3(other)));
      if (place == places.end()) continue;
      const StoredBlock& block = all.stored[place->second];
      finder.neighbourhood().add(direction(d), block.stored, cache.of(block), all.shell_bytes);
    }
    const BlockRecord found = finder.find(origin, wanted.stored);
    const int count = countOf(found.stored) + countOf(found.beyond);
    if (count == 0) continue;
    appendBlockRecord(aprons.records, all.info.block_side, found);
    for (std::size_t channel = 0; channel < aprons.ranges.size(); ++channel) {
      const std::span<const std::byte> ranges = finder.ranges(channel);
      aprons.ranges[channel].insert(aprons.ranges[channel].end(), ranges.begin(), ranges.end());
    }
    ++aprons.blocks;
    aprons.subblocks += static_cast<std::uint64_t>(count);
  }
  return aprons;
}

}  // namespace

void LevelShells::addBlock(glm::ivec3 origin, const SubblockSet& stored) {
  const StoredBlock block{.code = mortonCode(glm::uvec3(origin)), .first_subblock = subblocks_, .stored = stored};
  blocks_.append(std::as_bytes(std::span(&block, 1)));
  subblocks_ += static_cast<std::uint64_t>(countOf(stored));
}

LevelShells::Aprons LevelShells::find(const VolumeInfo& info, glm::ivec3 dims, TempBytes& blocks,
                                      std::span<TempBytes* const> apron_ranges, Workers& workers) {
  std::vector<StoredBlock> stored(static_cast<std::size_t>(blocks_.size() / sizeof(StoredBlock)));
  blocks_.read(0, std::as_writable_bytes(std::span(stored)));
  const AllShells all{.info = info,
                      .dims = dims,
                      .stored = stored,
                      .shells = shells_,
                      .shell_bytes = info.channels.size() * kShellParts * apronRangeBytes(info.type),
                      .cache_bytes = cache_bytes_ / (2 * static_cast<std::size_t>(workers.threads()))};
  std::unordered_map<std::uint64_t, std::size_t> places;
  places.reserve(stored.size());
  for (std::size_t i = 0; i < stored.size(); ++i) places.emplace(stored[i].code, i);

  Aprons aprons;
  JobsInOrder<FoundAprons> jobs(workers);
  const auto take = [&] {
    const FoundAprons found = jobs.take();
    blocks.append(found.records);
    for (std::size_t channel = 0; channel < apron_ranges.size(); ++channel) {
      apron_ranges[channel]->append(found.ranges[channel]);
    }
    aprons.blocks += found.blocks;
    aprons.subblocks += found.subblocks;
  };
  std::vector<WantedAprons> wanted;
  const auto find = [&] {
    if (jobs.full()) take();
    jobs.start([&, run = std::exchange(wanted, {})] { return findAprons(all, places, run); });
  };
  const auto want = [&](std::uint64_t code, const SubblockSet& own) {
    wanted.push_back({.code = code, .stored = own});
    if (wanted.size() == kJobBlocks) find();
  };
  const std::vector<std::uint64_t> around = blocksAround(stored, info, dims);
  auto next = around.begin();
  for (const StoredBlock& block : stored) {
    for (; next != around.end() && *next < block.code; ++next) want(*next, {});
    want(block.code, block.stored);
  }
  for (; next != around.end(); ++next) want(*next, {});
  if (!wanted.empty()) find();
  while (!jobs.empty()) take();
  return aprons;
}

}  // namespace blockwalk
