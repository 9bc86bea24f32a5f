// SPDX-License-Identifier: Apache-2.0
#include "volume/build/levels.h"

#include <algorithm>
#include <cstring>

#include "volume/build/workers.h"
#include "volume/error.h"
#include "volume/file/layout.h"

namespace blockwalk {
namespace {

// One channel of a subblock with the same `voxel` everywhere; zeros outside the level.
void fillConstant(std::span<std::byte> out, std::span<const std::byte> voxel, glm::ivec3 extent, int side) {
  std::ranges::fill(out, std::byte{0});
  for (int z = 0; z < extent.z; ++z) {
    for (int y = 0; y < extent.y; ++y) {
      for (int x = 0; x < extent.x; ++x) {
        std::memcpy(out.data() + static_cast<std::size_t>((z * side + y) * side + x) * voxel.size(), voxel.data(),
                    voxel.size());
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

LevelBuilder::LevelBuilder(const VolumeInfo& info, const BuildBudget& budget, const std::filesystem::path& folder,
                           Form form)
    : info_(info),
      first_level_(form == Form::values ? 0 : kFirstMaximaLevel),
      channel_bytes_(static_cast<std::size_t>(info.subblockVoxels()) * voxelBytes(info.type)),
      subblock_bytes_(channel_bytes_ * info.channels.size()),
      built_{.levels = {}, .maxima = {}, .counts = {}, .constants = TempBytes(folder, budget.stream_bytes)} {
  for (const ChannelInfo& channel : info.channels) {
    summaries_.emplace_back(info.type, info.subblock_side, channel);
    shell_readers_.emplace_back(info.type, info.subblock_side, channel);
    downsamplers_.emplace_back(info.type, info.subblock_side, channel, form);
  }
  built_.counts.resize(info.channels.size());
  const int count = levelCount(info.dims, info.blockVoxels());
  const auto stream = [&] { return TempBytes(folder, budget.stream_bytes / info.channels.size()); };
  for (int i = 0; i < count; ++i) {
    BuiltLevel& level = built_.levels.emplace_back(
        BuiltLevel{.info = {}, .slots = stream(), .counts = stream(), .blocks = stream(), .channels = {}});
    level.info.dims = levelDims(info.dims, i);
    for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
      level.channels.push_back({.ranges = stream(), .apron_ranges = stream(), .voxels = stream()});
    }
    shells_.emplace_back(std::in_place, folder, budget.stream_bytes, budget.shell_bytes);
  }
  pending_.resize(built_.levels.size());
  const bool has_amounts = std::ranges::any_of(
      info.channels, [](const ChannelInfo& channel) { return channel.values == ChannelValues::intensity; });
  if (form == Form::values && count > kFirstMaximaLevel && has_amounts) {
    maxima_.reset(new LevelBuilder(info, budget, folder, Form::maxima));
  }
}

glm::ivec3 LevelBuilder::localPosition(int local) const {
  return {local % info_.block_side, local / info_.block_side % info_.block_side,
          local / info_.block_side / info_.block_side};
}

std::size_t LevelBuilder::shellBytes() const {
  return info_.channels.size() * kShellParts * apronRangeBytes(info_.type);
}

glm::ivec3 LevelBuilder::extentOf(std::size_t level, glm::ivec3 origin, const Candidate& candidate) const {
  const glm::ivec3 position = origin * info_.block_side + localPosition(candidate.local);
  return insideExtent(position * info_.subblock_side, built_.levels[level].info.dims, info_.subblock_side);
}

LevelBuilder::Looks LevelBuilder::lookAt(std::size_t level, glm::ivec3 origin,
                                         std::span<const Candidate> candidates) const {
  Looks looks;
  looks.subblocks.resize(candidates.size());
  looks.nonempty.resize(candidates.size());
  looks.shells.resize(candidates.size() * shellBytes());
  looks.counts.resize(info_.channels.size());
  const std::size_t shell = shellBytes() / info_.channels.size();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const glm::ivec3 extent = extentOf(level, origin, candidates[i]);
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      const std::span<const std::byte> voxels = channelOf(candidates[i].voxels, channel);
      Subblock& subblock = looks.subblocks[i][channel];
      subblock = level == 0 ? summaries_[channel].summariseAndCount(voxels, extent, looks.counts[channel])
                            : summaries_[channel].summarise(voxels, extent);
      looks.nonempty[i] = looks.nonempty[i] || subblock.range_mask != 0;
    }
    for (std::size_t channel = 0; looks.nonempty[i] && channel < info_.channels.size(); ++channel) {
      shell_readers_[channel].read(channelOf(candidates[i].voxels, channel), extent,
                                   std::span(looks.shells).subspan(i * shellBytes() + channel * shell, shell));
    }
  }
  return looks;
}

void LevelBuilder::take(std::size_t level, glm::ivec3 origin, std::span<const Candidate> candidates,
                        const Looks& looks) {
  BuiltLevel& built = built_.levels[level];
  SubblockSet stored{};
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!looks.nonempty[i]) continue;
    const Candidate& candidate = candidates[i];
    const glm::ivec3 position = origin * info_.block_side + localPosition(candidate.local);
    const glm::ivec3 extent = extentOf(level, origin, candidate);
    if (level == 0 && maxima_) maxima_->coarsenInto(1, position, extent, candidate.voxels);
    insert(stored, candidate.local);
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      record_.clear();
      appendRange(record_, info_.type, looks.subblocks[i][channel]);
      built.channels[channel].ranges.append(record_);
    }
    shells_[level]->addSubblock(std::span(looks.shells).subspan(i * shellBytes(), shellBytes()));
    appendContent(level, candidate);
    if (level + 1 < built_.levels.size()) coarsenInto(level + 1, position, extent, candidate.voxels);
  }
  for (std::size_t channel = 0; level == 0 && channel < looks.counts.size(); ++channel) {
    built_.counts[channel].add(looks.counts[channel]);
  }
  const auto count = static_cast<std::uint8_t>(countOf(stored));
  if (count == 0) return;
  shells_[level]->addBlock(origin, stored);
  built.counts.append(std::as_bytes(std::span(&count, 1)));
  ++built.info.block_count;
  built.info.subblock_count += count;
}

void LevelBuilder::appendContent(std::size_t level, const Candidate& candidate) {
  if (level > 0) {
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      built_.levels[level].channels[channel].voxels.append(channelOf(candidate.voxels, channel));
    }
    return;
  }
  std::uint64_t slot = candidate.slot;
  if ((slot & kConstantSlot) != 0) {
    slot = kConstantSlot | built_.constants.size() / subblock_bytes_;
    built_.constants.append(candidate.voxels);
  }
  built_.levels[0].slots.append(std::as_bytes(std::span(&slot, 1)));
}

void LevelBuilder::coarsenInto(std::size_t level, glm::ivec3 subblock, glm::ivec3 extent,
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
  for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
    const std::span<std::byte> part = channelOf(target, channel);
    if (!pending.touched[local]) downsamplers_[channel].clear(part);
    downsamplers_[channel].add(channelOf(voxels, channel), extent, part, subblock - coarse * 2);
  }
  pending.touched[local] = true;
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
        insideExtent(position * info_.subblock_side, built_.levels[level].info.dims, info_.subblock_side);
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      clearOutside(channelOf(voxels, channel), voxelBytes(info_.type), extent, info_.subblock_side);
    }
    candidates.push_back({.local = static_cast<std::uint8_t>(local), .slot = 0, .voxels = voxels});
  }
  if (static_cast<int>(level) < first_level_) {
    for (const Candidate& candidate : candidates) {
      const glm::ivec3 position = pending.origin * info_.block_side + localPosition(candidate.local);
      coarsenInto(level + 1, position, extentOf(level, pending.origin, candidate), candidate.voxels);
    }
  } else {
    take(level, pending.origin, candidates, lookAt(level, pending.origin, candidates));
  }
  pending.any = false;
  pending.touched.fill(false);
}

void LevelBuilder::finishAprons(std::size_t level) {
  BuiltLevel& built = built_.levels[level];
  std::vector<TempBytes*> ranges;
  for (BuiltChannel& channel : built.channels) ranges.push_back(&channel.apron_ranges);
  const LevelShells::Aprons aprons = shells_[level]->find(info_, built.info.dims, built.blocks, ranges);
  shells_[level].reset();
  built.info.apron_block_count = aprons.blocks;
  built.info.apron_subblock_count = aprons.subblocks;
  built.info.voxel_bytes = built.info.subblock_count * channel_bytes_;
  if (aprons.subblocks > kMaxSubblocks) {
    failData("{}: level {} has {} subblocks, must be at most {}; take a larger subblock side",
             info_.metadata.source_name, level, aprons.subblocks, kMaxSubblocks);
  }
}

BuiltLevels LevelBuilder::finish() {
  for (std::size_t level = 0; level < built_.levels.size(); ++level) {
    if (level > 0) finishPending(level);
    if (static_cast<int>(level) >= first_level_) finishAprons(level);
  }
  if (maxima_) {
    BuiltLevels made = maxima_->finish();
    for (std::size_t level = kFirstMaximaLevel; level < made.levels.size(); ++level) {
      built_.maxima.push_back(std::move(made.levels[level]));
    }
  }
  return std::move(built_);
}

void loadSlots(const TempBytes& spill, const TempBytes& constants, std::span<const std::uint64_t> slots,
               const SlotPart& part, std::span<std::byte> out) {
  BLOCKWALK_CHECK(out.size(), ==, slots.size() * part.bytes);
  const bool whole = part.bytes == part.slot_bytes;
  for (std::size_t begin = 0; begin < slots.size();) {
    std::size_t end = begin + 1;
    while (whole && end < slots.size() && slots[end] == slots[end - 1] + 1) ++end;
    const bool constant = (slots[begin] & kConstantSlot) != 0;
    const std::uint64_t slot = slots[begin] & ~kConstantSlot;
    (constant ? constants : spill)
        .read(slot * part.slot_bytes + part.offset, out.subspan(begin * part.bytes, (end - begin) * part.bytes));
    begin = end;
  }
}

namespace {

// A block of level 0 with its voxels.
struct LoadedBlock {
  glm::ivec3 origin{0};
  std::vector<LevelBuilder::Candidate> candidates;
  std::vector<std::byte> voxels;  // those of the spill, then those of a single value
  LevelBuilder::Looks looks;
};

// Loads blocks; in several threads at a time.
class BlockLoader {
 public:
  BlockLoader(const Scan& scan, const VolumeInfo& info)
      : scan_(scan),
        info_(info),
        channel_bytes_(static_cast<std::size_t>(info.subblockVoxels()) * voxelBytes(info.type)),
        subblock_bytes_(channel_bytes_ * info.channels.size()) {}

  // Sets `voxels` of every candidate of the block at `origin`.
  LoadedBlock load(glm::ivec3 origin, std::vector<LevelBuilder::Candidate> candidates) const {
    LoadedBlock block{.origin = origin, .candidates = std::move(candidates), .voxels = {}, .looks = {}};
    std::vector<std::uint64_t> slots;
    for (const LevelBuilder::Candidate& candidate : block.candidates) {
      if ((candidate.slot & kConstantSlot) == 0) slots.push_back(candidate.slot);
    }
    block.voxels.resize(block.candidates.size() * subblock_bytes_);
    loadSlots(scan_.spill, scan_.constants, slots,
              {.slot_bytes = subblock_bytes_, .offset = 0, .bytes = subblock_bytes_},
              std::span(block.voxels).first(slots.size() * subblock_bytes_));
    std::size_t next_loaded = 0;
    std::size_t next_filled = slots.size();
    for (LevelBuilder::Candidate& candidate : block.candidates) {
      const bool constant = (candidate.slot & kConstantSlot) != 0;
      const std::size_t place = constant ? next_filled++ : next_loaded++;
      const std::span<std::byte> voxels = std::span(block.voxels).subspan(place * subblock_bytes_, subblock_bytes_);
      if (constant) fill(origin, candidate, voxels);
      candidate.voxels = voxels;
    }
    return block;
  }

 private:
  void fill(glm::ivec3 origin, const LevelBuilder::Candidate& candidate, std::span<std::byte> out) const {
    const int local = candidate.local;
    const int side = info_.block_side;
    const glm::ivec3 position = origin * side + glm::ivec3(local % side, local / side % side, local / side / side);
    const glm::ivec3 extent = insideExtent(position * info_.subblock_side, info_.dims, info_.subblock_side);
    const std::size_t voxel_bytes = voxelBytes(info_.type);
    std::array<std::byte, kMaxChannels * sizeof(float)> constants{};
    const std::span<std::byte> constant = std::span(constants).first(voxel_bytes * info_.channels.size());
    scan_.constants.read((candidate.slot & ~kConstantSlot) * constant.size(), constant);
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      fillConstant(out.subspan(channel * channel_bytes_, channel_bytes_),
                   constant.subspan(channel * voxel_bytes, voxel_bytes), extent, info_.subblock_side);
    }
  }

  const Scan& scan_;
  const VolumeInfo& info_;
  std::size_t channel_bytes_;
  std::size_t subblock_bytes_;
};

}  // namespace

BuiltLevels buildLevels(Scan& scan, const VolumeInfo& info, const BuildBudget& budget,
                        const std::filesystem::path& folder, const BuildOptions& options) {
  LevelBuilder builder(info, budget, folder);
  const BlockLoader loader(scan, info);
  Workers workers(workerCount(options.memory_bytes));
  JobsInOrder<LoadedBlock> jobs(workers);
  const auto takeOne = [&] {
    const LoadedBlock block = jobs.take();
    builder.add(block.origin, block.candidates, block.looks);
  };
  std::vector<LevelBuilder::Candidate> candidates;
  std::uint64_t code = 0;
  const auto flush = [&] {
    if (jobs.full()) takeOne();
    jobs.start([&builder, &loader, origin = mortonPosition(code), candidates] {
      LoadedBlock block = loader.load(origin, candidates);
      block.looks = builder.look(origin, block.candidates);
      return block;
    });
    candidates.clear();
  };

  SubblockRecord record;
  std::uint64_t done = 0;
  while (scan.records.next(record)) {
    if (!candidates.empty() && record.key >> 8 != code) flush();
    code = record.key >> 8;
    candidates.push_back({.local = static_cast<std::uint8_t>(record.key & 0xff), .slot = record.slot, .voxels = {}});
    if (options.progress && (++done % 4096 == 0 || done == scan.records.count())) {
      options.progress("build levels", done, scan.records.count());
    }
  }
  if (!candidates.empty()) flush();
  while (!jobs.empty()) takeOne();
  return builder.finish();
}

}  // namespace blockwalk
