// SPDX-License-Identifier: Apache-2.0
#include "volume/build_levels.h"

#include <algorithm>
#include <cstring>

#include "volume/error.h"
#include "volume/file_layout.h"

namespace blockwalk {
namespace {

int gatherBits(std::uint64_t code) {
  int value = 0;
  for (int bit = 0; bit < 21; ++bit) value |= static_cast<int>(code >> (3 * bit) & 1) << bit;
  return value;
}

glm::ivec3 mortonPosition(std::uint64_t code) {
  return {gatherBits(code), gatherBits(code >> 1), gatherBits(code >> 2)};
}

// A subblock of one value; zeros outside the level.
void fillConstant(std::span<std::byte> out, std::uint64_t slot, std::size_t voxel_bytes, glm::ivec3 extent, int side) {
  std::ranges::fill(out, std::byte{0});
  for (int z = 0; z < extent.z; ++z) {
    for (int y = 0; y < extent.y; ++y) {
      for (int x = 0; x < extent.x; ++x) {
        std::memcpy(out.data() + static_cast<std::size_t>((z * side + y) * side + x) * voxel_bytes, &slot, voxel_bytes);
      }
    }
  }
}

// Zeros what lies outside `extent`.
void clearOutside(std::span<std::byte> subblock, std::size_t voxel_bytes, glm::ivec3 extent, int side) {
  for (int z = 0; z < side; ++z) {
    for (int y = 0; y < side; ++y) {
      const int inside = z < extent.z && y < extent.y ? extent.x : 0;
      const auto row = static_cast<std::size_t>((z * side + y) * side + inside) * voxel_bytes;
      std::memset(subblock.data() + row, 0, static_cast<std::size_t>(side - inside) * voxel_bytes);
    }
  }
}

}  // namespace

LevelBuilder::LevelBuilder(VolumeInfo& info, TempBytes& spill, const BuildBudget& budget,
                           const std::filesystem::path& folder)
    : info_(info),
      spill_(spill),
      summary_(info.type, info.subblock_side, info.channels[0]),
      downsampler_(info.type, info.subblock_side, info.channels[0]),
      subblock_bytes_(static_cast<std::size_t>(info.subblockVoxels()) * voxelBytes(info.type)) {
  const int count = levelCount(info.dims, info.blockVoxels());
  for (int i = 0; i < count; ++i) {
    const auto stream = [&] { return TempBytes(folder, budget.stream_bytes); };
    levels_.push_back({.info = {}, .blocks = stream(), .subblocks = stream(), .content = stream()});
    levels_.back().info.dims = levelDims(info.dims, i);
  }
  pending_.resize(levels_.size());
}

glm::ivec3 LevelBuilder::localPosition(int local) const {
  return {local % info_.block_side, local / info_.block_side % info_.block_side,
          local / info_.block_side / info_.block_side};
}

void LevelBuilder::push(std::size_t level, glm::ivec3 origin, std::span<const Candidate> candidates) {
  BuiltLevel& built = levels_[level];
  Block block;
  block.origin = origin;
  for (const Candidate& candidate : candidates) {
    const glm::ivec3 position = origin * info_.block_side + localPosition(candidate.local);
    const glm::ivec3 extent = insideExtent(position * info_.subblock_side, built.info.dims, info_.subblock_side);
    const Subblock subblock = level == 0 ? summary_.summariseAndCount(candidate.voxels, extent, info_.channels[0])
                                         : summary_.summarise(candidate.voxels, extent);
    if (subblock.range_mask == 0) continue;
    const bool first = block.subblock_count == 0;
    block.density_min = first ? subblock.density_min : std::min(block.density_min, subblock.density_min);
    block.density_max = first ? subblock.density_max : std::max(block.density_max, subblock.density_max);
    block.range_mask |= subblock.range_mask;
    block.occupancy[candidate.local / 64] |= std::uint64_t{1} << (candidate.local % 64);
    ++block.subblock_count;
    record_.clear();
    appendSubblockRecord(record_, info_, subblock);
    built.subblocks.append(record_);
    appendContent(level, candidate);
    if (level + 1 < levels_.size()) averageInto(level + 1, position, extent, candidate.voxels);
  }
  if (block.subblock_count == 0) return;
  record_.clear();
  appendBlockRecord(record_, info_, block);
  built.blocks.append(record_);
  built.info.subblock_count += block.subblock_count;
  if (++built.info.block_count == kNoBlock) {
    failData("{}: level {} has more than {} blocks; take a larger block or subblock side", info_.source_name, level,
             kNoBlock - 1);
  }
}

void LevelBuilder::appendContent(std::size_t level, const Candidate& candidate) {
  if (level > 0) {
    levels_[level].content.append(candidate.voxels);
    return;
  }
  std::uint64_t slot = candidate.slot;
  if ((slot & kConstantSlot) != 0) {
    slot = spill_.size() / subblock_bytes_;
    spill_.append(candidate.voxels);
  }
  levels_[0].content.append(std::as_bytes(std::span(&slot, 1)));
}

void LevelBuilder::averageInto(std::size_t level, glm::ivec3 subblock, glm::ivec3 extent,
                               std::span<const std::byte> voxels) {
  const glm::ivec3 coarse = subblock / 2;
  const glm::ivec3 origin = coarse / info_.block_side;
  if (pending_[level].any && pending_[level].origin != origin) finishPending(level);
  Pending& pending = pending_[level];
  pending.any = true;
  pending.origin = origin;
  const glm::ivec3 at = coarse - origin * info_.block_side;
  const auto local = static_cast<std::size_t>(at.x + info_.block_side * (at.y + info_.block_side * at.z));
  const auto per_block = static_cast<std::size_t>(info_.block_side * info_.block_side * info_.block_side);
  pending.voxels.resize(per_block * subblock_bytes_);
  const std::span<std::byte> target = std::span(pending.voxels).subspan(local * subblock_bytes_, subblock_bytes_);
  if (!pending.touched[local]) downsampler_.clear(target);
  pending.touched[local] = true;
  downsampler_.average(voxels, extent, target, subblock - coarse * 2);
}

void LevelBuilder::finishPending(std::size_t level) {
  Pending& pending = pending_[level];
  if (!pending.any) return;
  std::vector<Candidate> candidates;
  for (std::size_t local = 0; local < pending.touched.size(); ++local) {
    if (!pending.touched[local]) continue;
    const std::span<std::byte> voxels = std::span(pending.voxels).subspan(local * subblock_bytes_, subblock_bytes_);
    const glm::ivec3 position = pending.origin * info_.block_side + localPosition(static_cast<int>(local));
    const glm::ivec3 extent =
        insideExtent(position * info_.subblock_side, levels_[level].info.dims, info_.subblock_side);
    clearOutside(voxels, voxelBytes(info_.type), extent, info_.subblock_side);
    candidates.push_back({.local = static_cast<std::uint8_t>(local), .slot = 0, .voxels = voxels});
  }
  push(level, pending.origin, candidates);
  pending.any = false;
  pending.touched.fill(false);
}

std::vector<BuiltLevel> LevelBuilder::finish() {
  for (std::size_t level = 1; level < levels_.size(); ++level) finishPending(level);
  info_.levels.clear();
  for (BuiltLevel& built : levels_) {
    built.info.voxel_bytes = built.info.subblock_count * subblock_bytes_;
    info_.levels.push_back(built.info);
  }
  return std::move(levels_);
}

void loadSlots(const TempBytes& spill, std::span<const std::uint64_t> slots, std::span<std::byte> out) {
  if (slots.empty()) return;
  const std::size_t bytes = out.size() / slots.size();
  for (std::size_t begin = 0; begin < slots.size();) {
    std::size_t end = begin + 1;
    while (end < slots.size() && slots[end] == slots[end - 1] + 1) ++end;
    spill.read(slots[begin] * bytes, out.subspan(begin * bytes, (end - begin) * bytes));
    begin = end;
  }
}

std::vector<BuiltLevel> buildLevels(Scan& scan, VolumeInfo& info, const BuildBudget& budget,
                                    const std::filesystem::path& folder, const BuildOptions& options) {
  LevelBuilder builder(info, scan.spill, budget, folder);
  const std::size_t voxel_bytes = voxelBytes(info.type);
  const std::size_t subblock_bytes = static_cast<std::size_t>(info.subblockVoxels()) * voxel_bytes;
  std::vector<LevelBuilder::Candidate> candidates;
  std::vector<std::uint64_t> slots;  // of the candidates that have one
  std::vector<std::byte> voxels;
  std::vector<std::byte> loaded;
  std::uint64_t code = 0;

  const auto flush = [&] {
    const glm::ivec3 origin = mortonPosition(code);
    voxels.resize(candidates.size() * subblock_bytes);
    loaded.resize(slots.size() * subblock_bytes);
    loadSlots(scan.spill, slots, loaded);
    std::size_t next = 0;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      LevelBuilder::Candidate& candidate = candidates[i];
      if ((candidate.slot & kConstantSlot) == 0) {
        candidate.voxels = std::span(loaded).subspan(next++ * subblock_bytes, subblock_bytes);
        continue;
      }
      const int local = candidate.local;
      const glm::ivec3 position =
          origin * info.block_side + glm::ivec3(local % info.block_side, local / info.block_side % info.block_side,
                                                local / info.block_side / info.block_side);
      const std::span<std::byte> out = std::span(voxels).subspan(i * subblock_bytes, subblock_bytes);
      fillConstant(out, candidate.slot, voxel_bytes,
                   insideExtent(position * info.subblock_side, info.dims, info.subblock_side), info.subblock_side);
      candidate.voxels = out;
    }
    builder.add(origin, candidates);
    candidates.clear();
    slots.clear();
  };

  SubblockRecord record;
  std::uint64_t done = 0;
  while (scan.records.next(record)) {
    if (!candidates.empty() && record.key >> 8 != code) flush();
    code = record.key >> 8;
    candidates.push_back({.local = static_cast<std::uint8_t>(record.key & 0xff), .slot = record.slot, .voxels = {}});
    if ((record.slot & kConstantSlot) == 0) slots.push_back(record.slot);
    if (options.progress && (++done % 4096 == 0 || done == scan.records.count())) {
      options.progress("build levels", done, scan.records.count());
    }
  }
  if (!candidates.empty()) flush();
  return builder.finish();
}

}  // namespace blockwalk
