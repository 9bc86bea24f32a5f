// SPDX-License-Identifier: Apache-2.0
#include "volume/export/nano_leaves.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <unordered_map>

#include "volume/error.h"

namespace blockwalk {
namespace {

std::uint64_t keyOf(glm::ivec3 cell) {
  return (static_cast<std::uint64_t>(cell.x) << 42) | (static_cast<std::uint64_t>(cell.y) << 21) |
         static_cast<std::uint64_t>(cell.z);
}

std::uint32_t leafNumber(glm::ivec3 cell) { return static_cast<std::uint32_t>((cell.x << 8) | (cell.y << 4) | cell.z); }

glm::ivec3 leafCell(std::uint32_t number) {
  return {static_cast<int>(number >> 8), static_cast<int>(number >> 4 & 15), static_cast<int>(number & 15)};
}

// Marks the leaves that a box of voxels touches.
class CandidateMarker {
 public:
  explicit CandidateMarker(const std::filesystem::path& path) : path_(path) {}

  void mark(glm::ivec3 begin, glm::ivec3 end) {
    const glm::ivec3 first = begin / kNanoLeafSide;
    const glm::ivec3 last = (end - 1) / kNanoLeafSide;
    for (int x = first.x; x <= last.x; ++x) {
      for (int y = first.y; y <= last.y; ++y) {
        for (int z = first.z; z <= last.z; ++z) markLeaf({x, y, z});
      }
    }
  }

  std::vector<NanoLower> take() {
    std::ranges::sort(nodes_, [](const NanoLower& a, const NanoLower& b) {
      const auto key = [](const NanoLower& node) { return std::pair(nanoRootKey(node.cell), nanoEntry(node.cell)); };
      return key(a) < key(b);
    });
    return std::move(nodes_);
  }

 private:
  void markLeaf(glm::ivec3 leaf) {
    const glm::ivec3 cell = leaf / 16;
    const auto [found, is_new] = places_.try_emplace(keyOf(cell), nodes_.size());
    if (is_new) {
      if (nodes_.size() == kMostNanoLowers) {
        failData("{}: the volume touches more than {} cubes of {} voxels a side; export a box or a coarser level",
                 path_.filename().string(), kMostNanoLowers, kNanoLowerSide);
      }
      nodes_.emplace_back().cell = cell;
    }
    const std::uint32_t number = leafNumber(leaf - cell * 16);
    nodes_[found->second].leaves[number / 64] |= std::uint64_t{1} << (number % 64);
  }

  const std::filesystem::path& path_;
  std::unordered_map<std::uint64_t, std::size_t> places_;
  std::vector<NanoLower> nodes_;
};

}  // namespace

void NanoExtent::add(const NanoExtent& other) {
  if (other.voxels == 0) return;
  value_min = voxels == 0 ? other.value_min : std::min(value_min, other.value_min);
  value_max = voxels == 0 ? other.value_max : std::max(value_max, other.value_max);
  least = glm::min(least, other.least);
  greatest = glm::max(greatest, other.greatest);
  voxels += other.voxels;
}

std::uint64_t nanoRootKey(glm::ivec3 lower_cell) { return keyOf(lower_cell / 32); }

std::uint32_t nanoEntry(glm::ivec3 lower_cell) {
  const glm::ivec3 cell = lower_cell % 32;
  return static_cast<std::uint32_t>((cell.x << 10) | (cell.y << 5) | cell.z);
}

std::vector<NanoLower> nanoCandidates(const ExportJob& job) {
  const VolumeInfo& info = job.file.info();
  const Level level = job.file.readLevel(job.level, 0);
  CandidateMarker marker(job.file.path());
  const int blocks = info.block_side;
  const int side = info.subblock_side;
  for (const Block& block : level.blocks) {
    for (int local = 0; local < blocks * blocks * blocks; ++local) {
      if ((block.occupancy[static_cast<std::size_t>(local) / 64] >> (local % 64) & 1) == 0) continue;
      const glm::ivec3 place(local % blocks, local / blocks % blocks, local / (blocks * blocks));
      const glm::ivec3 origin = (block.origin * blocks + place) * side;
      const glm::ivec3 begin = glm::max(origin, job.box.begin) - job.box.begin;
      const glm::ivec3 end = glm::min(origin + side, job.box.end) - job.box.begin;
      if (glm::all(glm::lessThan(begin, end))) marker.mark(begin, end);
    }
  }
  return marker.take();
}

NanoLeafReader::NanoLeafReader(const ExportJob& job, std::size_t channel)
    : job_(job), channel_(channel), reader_(job.file, job.level) {
  if (job.type() != VoxelType::rgba8) background_ = valueOf(emptyValue(job.type(), job.channel(channel)));
}

std::array<std::byte, 4> NanoLeafReader::valueOf(float stored) const {
  const ChannelInfo& channel = job_.channel(channel_);
  const bool is_same = channel.value_scale == 1 && channel.value_offset == 0;
  const float value = is_same ? stored : static_cast<float>(channel.dataFromStored(static_cast<double>(stored)));
  return std::bit_cast<std::array<std::byte, 4>>(value);
}

void NanoLeafReader::read(const NanoLower& node, const std::function<void(const NanoLeaf&)>& visit) {
  // No more than the leaves that may be there.
  const glm::ivec3 dims = job_.box.dims();
  const glm::ivec3 corner = node.cell * kNanoLowerSide;
  VoxelBox box{.begin = glm::ivec3(INT32_MAX), .end = glm::ivec3(0)};
  const auto forEachLeaf = [&](const auto& use) {
    for (std::uint32_t word = 0; word < node.leaves.size(); ++word) {
      for (std::uint64_t bits = node.leaves[word]; bits != 0; bits &= bits - 1) {
        use(corner + leafCell(word * 64 + static_cast<std::uint32_t>(std::countr_zero(bits))) * kNanoLeafSide);
      }
    }
  };
  forEachLeaf([&](glm::ivec3 origin) {
    box.begin = glm::min(box.begin, origin);
    box.end = glm::max(box.end, glm::min(origin + kNanoLeafSide, dims));
  });
  voxels_.resize(box.voxels() * voxelBytes(job_.type()));
  reader_.read(job_.channels[channel_], {.begin = box.begin + job_.box.begin, .end = box.end + job_.box.begin},
               voxels_);
  NanoLeaf leaf;
  forEachLeaf([&](glm::ivec3 origin) {
    if (fill(origin, box, leaf)) visit(leaf);
  });
}

bool NanoLeafReader::fill(glm::ivec3 origin, const VoxelBox& box, NanoLeaf& leaf) const {
  const VoxelType type = job_.type();
  const std::size_t bytes = voxelBytes(type);
  const float threshold = job_.channel(channel_).empty_threshold;
  const glm::ivec3 end = glm::min(origin + kNanoLeafSide, box.end) - origin;
  const glm::i64vec3 dims(box.dims());
  leaf.origin = origin;
  leaf.mask.fill(0);
  leaf.values.fill(background_);
  leaf.extent = {};
  for (int z = 0; z < end.z; ++z) {
    for (int y = 0; y < end.y; ++y) {
      const glm::i64vec3 row(origin - box.begin + glm::ivec3(0, y, z));
      const std::byte* voxel = &voxels_[static_cast<std::size_t>((row.z * dims.y + row.y) * dims.x + row.x) * bytes];
      for (int x = 0; x < end.x; ++x, voxel += bytes) {
        const float stored = storedDensity(type, voxel);
        if (isEmptyDensity(stored, threshold)) continue;
        const auto number = static_cast<std::size_t>((x << 6) | (y << 3) | z);
        leaf.mask[number / 64] |= std::uint64_t{1} << (number % 64);
        auto& value = leaf.values[number];
        if (type == VoxelType::rgba8) {
          std::memcpy(value.data(), voxel, value.size());
        } else {
          value = valueOf(stored);
        }
        const float number_of_it = type == VoxelType::rgba8 ? stored : std::bit_cast<float>(value);
        const glm::ivec3 place = origin + glm::ivec3(x, y, z);
        leaf.extent.add({place, place, number_of_it, number_of_it, 1});
      }
    }
  }
  return leaf.extent.voxels > 0;
}

}  // namespace blockwalk
