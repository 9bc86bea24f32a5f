// SPDX-License-Identifier: Apache-2.0
// Blocks of level 0 are looked at on workers, and given to the builder of the levels in their order.
#include <algorithm>
#include <cstring>
#include <utility>

#include "volume/build/levels.h"
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

// Blocks are looked at in one job until they have as many bytes of voxels and of what else a block takes: handing it
// over takes as long as looking at some subblocks.
constexpr std::size_t kJobBytes = std::size_t{1} << 20;
constexpr std::size_t kBlockBytes = 512;  // lists of candidates and findings: most of a block of a single subblock
constexpr std::size_t kKeptBlocks = 16;   // of a job, for their memory

struct WantedBlock {
  glm::ivec3 origin{0};
  std::vector<LevelBuilder::Candidate> candidates;
};

// A block that is looked at, with the voxels that its findings refer to.
class FoundBlock {
 public:
  const LevelBuilder::Findings& findings() const { return findings_; }

  void find(const Scan& scan, const VolumeInfo& info, const LevelBuilder& builder, glm::ivec3 origin,
            std::span<LevelBuilder::Candidate> candidates) {
    load(scan, info, origin, candidates);
    builder.find(origin, candidates, findings_);
  }

 private:
  // Sets `voxels` of every candidate: where the spill has it in memory, else here.
  void load(const Scan& scan, const VolumeInfo& info, glm::ivec3 origin,
            std::span<LevelBuilder::Candidate> candidates) {
    const std::size_t subblock_bytes =
        static_cast<std::size_t>(info.subblockVoxels()) * voxelBytes(info.type) * info.channels.size();
    std::vector<std::uint64_t> slots;
    std::size_t constants = 0;
    for (LevelBuilder::Candidate& candidate : candidates) {
      const bool constant = (candidate.slot & kConstantSlot) != 0;
      if (!constant) candidate.voxels = scan.spill->inMemory(candidate.slot, 1);
      constants += constant ? 1 : 0;
      if (!constant && candidate.voxels.empty()) slots.push_back(candidate.slot);
    }
    voxels_.resize((slots.size() + constants) * subblock_bytes);
    std::size_t next_spilled = 0;
    std::size_t next_filled = slots.size() * subblock_bytes;
    loadSlots(*scan.spill, scan.constants, slots, {.slot_bytes = subblock_bytes, .offset = 0, .bytes = subblock_bytes},
              std::span(voxels_).first(next_filled));
    for (LevelBuilder::Candidate& candidate : candidates) {
      if (!candidate.voxels.empty()) continue;
      const bool constant = (candidate.slot & kConstantSlot) != 0;
      std::size_t& next = constant ? next_filled : next_spilled;
      const std::span<std::byte> voxels = std::span(voxels_).subspan(next, subblock_bytes);
      next += subblock_bytes;
      if (constant) fill(scan, info, origin, candidate, voxels);
      candidate.voxels = voxels;
    }
  }

  static void fill(const Scan& scan, const VolumeInfo& info, glm::ivec3 origin,
                   const LevelBuilder::Candidate& candidate, std::span<std::byte> out) {
    const int local = candidate.local;
    const int side = info.block_side;
    const glm::ivec3 position = origin * side + glm::ivec3(local % side, local / side % side, local / side / side);
    const glm::ivec3 extent = insideExtent(position * info.subblock_side, info.dims, info.subblock_side);
    const std::size_t voxel_bytes = voxelBytes(info.type);
    const std::size_t channel_bytes = out.size() / info.channels.size();
    std::vector<std::byte> constant(voxel_bytes * info.channels.size());
    scan.constants.read((candidate.slot & ~kConstantSlot) * constant.size(), constant);
    for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
      fillConstant(out.subspan(channel * channel_bytes, channel_bytes),
                   std::span(constant).subspan(channel * voxel_bytes, voxel_bytes), extent, info.subblock_side);
    }
  }

  std::vector<std::byte> voxels_;
  LevelBuilder::Findings findings_;
};

}  // namespace

BuiltLevels buildLevels(Scan& scan, const VolumeInfo& info, const BuildBudget& budget,
                        const std::filesystem::path& folder, const BuildOptions& options, Workers& workers) {
  LevelBuilder builder(info, budget, folder);
  JobsInOrder<std::vector<FoundBlock>> jobs(workers);
  std::vector<FoundBlock> done_with;  // for its memory
  const auto takeBlocks = [&] {
    done_with = jobs.take();
    for (const FoundBlock& block : done_with) builder.add(block.findings());
    if (done_with.size() > kKeptBlocks) done_with.clear();  // blocks that grow in turn would be too much
  };
  const std::size_t subblock_bytes =
      static_cast<std::size_t>(info.subblockVoxels()) * voxelBytes(info.type) * info.channels.size();
  std::vector<WantedBlock> wanted;
  std::size_t wanted_bytes = 0;
  const auto find = [&] {
    if (jobs.full()) takeBlocks();
    jobs.start(
        [&scan, &info, &builder, blocks = std::exchange(wanted, {}), found = std::exchange(done_with, {})]() mutable {
          found.resize(blocks.size());
          for (std::size_t i = 0; i < blocks.size(); ++i) {
            found[i].find(scan, info, builder, blocks[i].origin, blocks[i].candidates);
          }
          return std::move(found);
        });
    wanted_bytes = 0;
  };
  std::vector<LevelBuilder::Candidate> candidates;
  std::uint64_t code = 0;
  const auto flush = [&] {
    wanted_bytes += kBlockBytes + candidates.size() * subblock_bytes;
    wanted.push_back({.origin = mortonPosition(code), .candidates = std::exchange(candidates, {})});
    if (wanted_bytes > kJobBytes) find();
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
  if (!wanted.empty()) find();
  while (!jobs.empty()) takeBlocks();
  return builder.finish(workers);
}

}  // namespace blockwalk
