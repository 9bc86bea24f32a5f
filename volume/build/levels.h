// SPDX-License-Identifier: Apache-2.0
// The second pass: records and coarser levels, built together from level 0's blocks in one walk along the Morton curve.
//
// The eight children of a coarse block follow each other on the curve, so a level holds one unfinished block at a time:
// it is finished when a child of another block arrives, and is then itself the next child of the level above.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "volume/build/aprons.h"
#include "volume/build/budget.h"
#include "volume/build/downsample.h"
#include "volume/build/scan.h"
#include "volume/build/storage.h"
#include "volume/build/summary.h"
#include "volume/build/workers.h"

namespace blockwalk {

// One channel of a finished level, as the file will hold it.
struct BuiltChannel {
  TempBytes ranges;
  TempBytes apron_ranges;
  TempBytes voxels;  // of coarser levels
};

struct BuiltLevel {
  LevelInfo info;
  TempBytes slots;   // of level 0: a u64 a subblock, where its voxels are; with kConstantSlot in `constants`
  TempBytes counts;  // a u8 a stored block: its subblocks
  TempBytes blocks;  // block records
  std::vector<BuiltChannel> channels;
};

struct BuiltLevels {
  std::vector<BuiltLevel> levels;     // of values
  std::vector<BuiltLevel> maxima;     // from level kFirstMaximaLevel on, or none
  std::vector<ChannelCounts> counts;  // by channel, of f32; else none
  TempBytes constants;                // subblocks of level 0 that the spill has not, each channel after channel
};

class LevelBuilder {
 public:
  // `info` is complete but for what this finds: levels, and of the channels histogram and nonempty_voxels. It outlives
  // the builder. Levels of values, and of maxima where there are such levels and a channel that is not of labels.
  LevelBuilder(const VolumeInfo& info, const BuildBudget& budget, const std::filesystem::path& folder)
      : LevelBuilder(info, budget, folder, Form::values) {}

  struct Candidate {
    std::uint8_t local = 0;
    std::uint64_t slot = 0;             // level 0
    std::span<const std::byte> voxels;  // channel after channel
  };
  // What follows from one block's voxels alone. Refers to the candidates' voxels.
  struct Findings {
    glm::ivec3 origin{0};
    std::vector<Candidate> stored;          // those with a non-empty voxel in some channel
    std::vector<std::byte> ranges;          // of each, as the file holds them; in a subblock channel after channel
    std::vector<std::byte> shells;          // likewise
    std::vector<std::byte> octants;         // of the level above; where there is one
    std::vector<std::byte> maxima_octants;  // of level 1 of the maxima; where there are some
    std::vector<ChannelCounts> counts;      // of level 0 and f32
  };
  // The candidates of one block of level 0, in ascending order of `local`. May run at the same time in several threads,
  // and beside add().
  // `findings` is replaced, but for its memory.
  void find(glm::ivec3 origin, std::span<const Candidate> candidates, Findings& findings) const {
    find(0, origin, candidates, findings);
  }
  // Takes blocks of level 0 in Morton order.
  void add(const Findings& findings) { push(0, findings); }
  // Finishes all levels.
  BuiltLevels finish(Workers& workers);

 private:
  LevelBuilder(const VolumeInfo& info, const BuildBudget& budget, const std::filesystem::path& folder, Form form);

  struct Pending {
    bool any = false;
    glm::ivec3 origin{0};
    std::array<bool, kMaxBlockSide * kMaxBlockSide * kMaxBlockSide> touched{};
    std::vector<std::byte> voxels;  // block_side^3 subblocks, each channel after channel
  };
  template <typename Bytes>
  Bytes channelOf(Bytes subblock, std::size_t channel) const {
    return subblock.subspan(channel * channel_bytes_, channel_bytes_);
  }
  void find(std::size_t level, glm::ivec3 origin, std::span<const Candidate> candidates, Findings& findings) const;
  // False when all channels are empty, and then nothing was added.
  bool appendRanges(const Candidate& candidate, glm::ivec3 extent, Findings& findings) const;
  void appendShell(const Candidate& candidate, glm::ivec3 extent, std::vector<std::byte>& shells) const;
  void appendOctant(const Candidate& candidate, glm::ivec3 extent, std::vector<std::byte>& octants) const;
  void push(std::size_t level, const Findings& findings);
  void appendRecords(std::size_t level, const Findings& findings);
  void appendContent(std::size_t level, const Candidate& candidate);
  // `octants`: of each subblock, on the level below `level`.
  void coarsenInto(std::size_t level, const Findings& findings, std::span<const std::byte> octants);
  // `child`: the subblock that the octant is made of, counted from the first below the pending block; `extent` of it
  // lies inside its level.
  void placeOctant(Pending& pending, glm::ivec3 child, glm::ivec3 extent, std::span<const std::byte> octant) const;
  void finishPending(std::size_t level);
  void finishAprons(std::size_t level, Workers& workers);
  glm::ivec3 localPosition(int local) const { return local_positions_[static_cast<std::size_t>(local)]; }

  const VolumeInfo& info_;
  int first_level_;                          // which is kept; finer ones are only made to get there
  std::unique_ptr<LevelBuilder> maxima_;     // fed with what is kept of level 0
  std::vector<SubblockSummary> summaries_;   // by channel
  std::vector<ShellReader> shell_readers_;   // by channel
  std::vector<Downsampler> downsamplers_;    // by channel
  std::size_t channel_bytes_;                // of a subblock in one channel
  std::size_t subblock_bytes_;               // in all
  std::vector<glm::ivec3> local_positions_;  // of subblocks in their block
  BuiltLevels built_;
  std::vector<std::optional<LevelShells>> shells_;  // of a level until it is finished
  std::vector<Pending> pending_;                    // [0] is not used
};

// Feeds the scan's records to a LevelBuilder, block by block.
BuiltLevels buildLevels(Scan& scan, const VolumeInfo& info, const BuildBudget& budget,
                        const std::filesystem::path& folder, const BuildOptions& options, Workers& workers);

// Where in a slot to read: `bytes` from `offset` on, of the `slot_bytes` that a slot has.
struct SlotPart {
  std::size_t slot_bytes = 0;
  std::size_t offset = 0;
  std::size_t bytes = 0;
};

// Reads that part of each slot, one after the other into `out`, from the spill or, where a slot has kConstantSlot, from
// the constants; whole slots that are neighbours are read at once.
void loadSlots(const Spill& spill, const TempBytes& constants, std::span<const std::uint64_t> slots,
               const SlotPart& part, std::span<std::byte> out);

}  // namespace blockwalk
