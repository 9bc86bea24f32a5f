// SPDX-License-Identifier: Apache-2.0
#include "volume/build/levels.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "volume/error.h"
#include "volume/file/layout.h"

namespace blockwalk {
namespace {

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

// Rows of an octant, of `half` each way, into the subblock that is twice as wide. `row_bytes`: what of a row is inside;
// known where `bytes` is not 0.
template <std::size_t bytes>
void copyOctant(const std::byte* from, std::byte* to, glm::ivec3 inside, std::size_t half, std::size_t voxel_bytes,
                std::size_t row_bytes) {
  const std::size_t octant_row = half * voxel_bytes;
  for (std::size_t z = 0; z < static_cast<std::size_t>(inside.z); ++z) {
    for (std::size_t y = 0; y < static_cast<std::size_t>(inside.y); ++y) {
      std::memcpy(to + (z * 2 * half + y) * 2 * octant_row, from + (z * half + y) * octant_row,
                  bytes == 0 ? row_bytes : bytes);
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
  const int side = info.block_side;
  for (int local = 0; local < side * side * side; ++local) {
    local_positions_.emplace_back(local % side, local / side % side, local / (side * side));
  }
  if (info.type == VoxelType::f32) built_.counts.resize(info.channels.size());
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

void LevelBuilder::find(std::size_t level, glm::ivec3 origin, std::span<const Candidate> candidates,
                        Findings& findings) const {
  findings.origin = origin;
  findings.stored.clear();
  for (auto* bytes : {&findings.ranges, &findings.shells, &findings.octants, &findings.maxima_octants}) bytes->clear();
  findings.counts.assign(level == 0 ? built_.counts.size() : 0, {});
  const bool kept = static_cast<int>(level) >= first_level_;
  for (const Candidate& candidate : candidates) {
    const glm::ivec3 position = origin * info_.block_side + localPosition(candidate.local);
    const glm::ivec3 extent =
        insideExtent(position * info_.subblock_side, built_.levels[level].info.dims, info_.subblock_side);
    if (kept && !appendRanges(candidate, extent, findings)) continue;
    findings.stored.push_back(candidate);
    if (kept) appendShell(candidate, extent, findings.shells);
    if (level + 1 < built_.levels.size()) appendOctant(candidate, extent, findings.octants);
    if (level == 0 && maxima_) maxima_->appendOctant(candidate, extent, findings.maxima_octants);
  }
}

bool LevelBuilder::appendRanges(const Candidate& candidate, glm::ivec3 extent, Findings& findings) const {
  const std::size_t begin = findings.ranges.size();
  bool any = false;
  for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
    const std::span<const std::byte> voxels = channelOf(candidate.voxels, channel);
    const Subblock range = findings.counts.empty()
                               ? summaries_[channel].summarise(voxels, extent)
                               : summaries_[channel].summariseAndCount(voxels, extent, findings.counts[channel]);
    any = any || range.range_mask != 0;
    appendRange(findings.ranges, info_.type, range);
  }
  if (!any) findings.ranges.resize(begin);
  return any;
}

void LevelBuilder::appendShell(const Candidate& candidate, glm::ivec3 extent, std::vector<std::byte>& shells) const {
  const std::size_t each = kShellParts * apronRangeBytes(info_.type);
  for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
    shells.resize(shells.size() + each);
    shell_readers_[channel].read(channelOf(candidate.voxels, channel), extent, std::span(shells).last(each));
  }
}

void LevelBuilder::appendOctant(const Candidate& candidate, glm::ivec3 extent, std::vector<std::byte>& octants) const {
  const std::size_t each = channel_bytes_ / 8;
  for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
    octants.resize(octants.size() + each);
    downsamplers_[channel].coarsen(channelOf(candidate.voxels, channel), extent, std::span(octants).last(each));
  }
}

void LevelBuilder::push(std::size_t level, const Findings& findings) {
  if (static_cast<int>(level) >= first_level_) appendRecords(level, findings);
  if (level + 1 < built_.levels.size()) coarsenInto(level + 1, findings, findings.octants);
  if (level == 0 && maxima_) maxima_->coarsenInto(1, findings, findings.maxima_octants);
}

void LevelBuilder::appendRecords(std::size_t level, const Findings& findings) {
  if (findings.stored.empty()) return;
  BuiltLevel& built = built_.levels[level];
  const std::size_t channels = info_.channels.size();
  const std::size_t range_bytes = rangeBytes(info_.type);
  const std::size_t shell_bytes = channels * kShellParts * apronRangeBytes(info_.type);
  SubblockSet stored{};
  for (std::size_t i = 0; i < findings.stored.size(); ++i) {
    insert(stored, findings.stored[i].local);
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const std::size_t at = (i * channels + channel) * range_bytes;
      built.channels[channel].ranges.append(std::span(findings.ranges).subspan(at, range_bytes));
    }
    shells_[level]->addSubblock(std::span(findings.shells).subspan(i * shell_bytes, shell_bytes));
    appendContent(level, findings.stored[i]);
  }
  shells_[level]->addBlock(findings.origin, stored);
  const auto count = static_cast<std::uint8_t>(findings.stored.size());
  built.counts.append(std::as_bytes(std::span(&count, 1)));
  ++built.info.block_count;
  built.info.subblock_count += count;
  for (std::size_t channel = 0; channel < findings.counts.size(); ++channel) {
    built_.counts[channel].add(findings.counts[channel]);
  }
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

void LevelBuilder::coarsenInto(std::size_t level, const Findings& findings, std::span<const std::byte> octants) {
  if (findings.stored.empty()) return;
  const glm::ivec3 origin = findings.origin / 2;
  Pending& pending = pending_[level];
  if (pending.any && pending.origin != origin) finishPending(level);
  pending.any = true;
  pending.origin = origin;
  pending.voxels.resize(local_positions_.size() * subblock_bytes_);
  const glm::ivec3 first = (findings.origin - origin * 2) * info_.block_side;
  for (std::size_t i = 0; i < findings.stored.size(); ++i) {
    const glm::ivec3 local = localPosition(findings.stored[i].local);
    const glm::ivec3 position = findings.origin * info_.block_side + local;
    const glm::ivec3 extent =
        insideExtent(position * info_.subblock_side, built_.levels[level - 1].info.dims, info_.subblock_side);
    placeOctant(pending, first + local, extent, octants.subspan(i * subblock_bytes_ / 8, subblock_bytes_ / 8));
  }
}

void LevelBuilder::placeOctant(Pending& pending, glm::ivec3 child, glm::ivec3 extent,
                               std::span<const std::byte> octant) const {
  const glm::ivec3 at = child / 2;
  const auto local = static_cast<std::size_t>(at.x + info_.block_side * (at.y + info_.block_side * at.z));
  const std::span<std::byte> target = std::span(pending.voxels).subspan(local * subblock_bytes_, subblock_bytes_);
  const auto half = static_cast<std::size_t>(info_.subblock_side / 2);
  const glm::ivec3 base = (child - at * 2) * (info_.subblock_side / 2);
  const glm::ivec3 inside = (extent + 1) / 2;
  const std::size_t voxel_bytes = voxelBytes(info_.type);
  const std::size_t row_bytes = static_cast<std::size_t>(inside.x) * voxel_bytes;
  const auto offset = static_cast<std::size_t>((base.z * info_.subblock_side + base.y) * info_.subblock_side + base.x);
  for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
    const std::span<std::byte> part = channelOf(target, channel);
    if (!pending.touched[local]) downsamplers_[channel].clear(part);
    const std::byte* from = octant.data() + channel * (channel_bytes_ / 8);
    std::byte* to = part.data() + offset * voxel_bytes;
    if (row_bytes == 4) {
      copyOctant<4>(from, to, inside, half, voxel_bytes, row_bytes);
    } else if (row_bytes == 8) {
      copyOctant<8>(from, to, inside, half, voxel_bytes, row_bytes);
    } else if (row_bytes == 16) {
      copyOctant<16>(from, to, inside, half, voxel_bytes, row_bytes);
    } else {
      copyOctant<0>(from, to, inside, half, voxel_bytes, row_bytes);
    }
  }
  pending.touched[local] = true;
}

void LevelBuilder::finishPending(std::size_t level) {
  Pending& pending = pending_[level];
  if (!pending.any) return;
  const glm::ivec3 whole(info_.subblock_side);
  std::vector<Candidate> candidates;
  for (std::size_t local = 0; local < local_positions_.size(); ++local) {
    if (!pending.touched[local]) continue;
    const std::span<std::byte> voxels = std::span(pending.voxels).subspan(local * subblock_bytes_, subblock_bytes_);
    const glm::ivec3 position = pending.origin * info_.block_side + localPosition(static_cast<int>(local));
    const glm::ivec3 extent =
        insideExtent(position * info_.subblock_side, built_.levels[level].info.dims, info_.subblock_side);
    for (std::size_t channel = 0; channel < info_.channels.size() && extent != whole; ++channel) {
      clearOutside(channelOf(voxels, channel), voxelBytes(info_.type), extent, info_.subblock_side);
    }
    candidates.push_back({.local = static_cast<std::uint8_t>(local), .slot = 0, .voxels = voxels});
  }
  Findings findings;
  find(level, pending.origin, candidates, findings);
  push(level, findings);
  pending.any = false;
  pending.touched.fill(false);
}

void LevelBuilder::finishAprons(std::size_t level, Workers& workers) {
  BuiltLevel& built = built_.levels[level];
  std::vector<TempBytes*> ranges;
  for (BuiltChannel& channel : built.channels) ranges.push_back(&channel.apron_ranges);
  const LevelShells::Aprons aprons = shells_[level]->find(info_, built.info.dims, built.blocks, ranges, workers);
  shells_[level].reset();
  built.info.apron_block_count = aprons.blocks;
  built.info.apron_subblock_count = aprons.subblocks;
  built.info.voxel_bytes = built.info.subblock_count * channel_bytes_;
  if (aprons.subblocks > kMaxSubblocks) {
    failData("{}: level {} has {} subblocks, must be at most {}; take a larger subblock side",
             info_.metadata.source_name, level, aprons.subblocks, kMaxSubblocks);
  }
}

BuiltLevels LevelBuilder::finish(Workers& workers) {
  for (std::size_t level = 0; level < built_.levels.size(); ++level) {
    if (level > 0) finishPending(level);
    if (static_cast<int>(level) >= first_level_) finishAprons(level, workers);
  }
  if (maxima_) {
    BuiltLevels made = maxima_->finish(workers);
    for (std::size_t level = kFirstMaximaLevel; level < made.levels.size(); ++level) {
      built_.maxima.push_back(std::move(made.levels[level]));
    }
  }
  return std::move(built_);
}

void loadSlots(const Spill& spill, const TempBytes& constants, std::span<const std::uint64_t> slots,
               const SlotPart& part, std::span<std::byte> out) {
  BLOCKWALK_CHECK(out.size(), ==, slots.size() * part.bytes);
  const bool whole = part.bytes == part.slot_bytes;
  for (std::size_t begin = 0; begin < slots.size();) {
    std::size_t end = begin + 1;
    while (whole && end < slots.size() && slots[end] == slots[end - 1] + 1) ++end;
    const bool constant = (slots[begin] & kConstantSlot) != 0;
    const std::uint64_t slot = slots[begin] & ~kConstantSlot;
    const std::span<std::byte> to = out.subspan(begin * part.bytes, (end - begin) * part.bytes);
    if (constant) {
      constants.read(slot * part.slot_bytes + part.offset, to);
    } else {
      spill.read(slot * part.slot_bytes + part.offset, to);
    }
    begin = end;
  }
}

}  // namespace blockwalk
