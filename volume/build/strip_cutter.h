// SPDX-License-Identifier: Apache-2.0
// Cuts strips into subblocks of level 0 and decides what becomes of each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "volume/build/sort.h"
#include "volume/build/spill.h"
#include "volume/build/strips.h"
#include "volume/volume.h"

namespace blockwalk {

// What became of some strips.
struct CutSubblocks {
  std::vector<SubblockRecord> records;  // with kConstantSlot the slot counts in `constants`
  std::vector<std::byte> constants;     // a voxel of each channel each
};

// What goes into the spill gathers first, up to `group_bytes`, and is appended in the order of its keys: the next
// passes read block after block, and a strip holds one row of many blocks.
class StripCutter {
 public:
  // `thresholds`: by channel, where they are known. Where all are, subblocks without a non-empty voxel in any channel
  // are left out; where one is not, those of a single value in each channel are constants.
  StripCutter(const VolumeInfo& info, std::span<const std::optional<float>> thresholds, std::size_t group_bytes,
              Spill& spill);

  void cut(const Strip& strip);
  // What was cut since the last call.
  CutSubblocks take();

 private:
  std::span<std::byte> subblockOf(std::size_t channel);
  template <typename VoxelsOf>
  bool anyChannel(VoxelsOf voxelsOf) const;
  void gather(const Strip& strip, std::size_t channel, int x, glm::ivec3 extent);
  bool isConstant(const Strip& strip, std::size_t channel, int x, glm::ivec3 extent) const;
  const std::byte* rowOf(const Strip& strip, std::size_t channel, glm::ivec3 voxel) const;
  void store(std::uint64_t key, bool constant);
  std::uint64_t constantIndex();
  void flush();

  const VolumeInfo& info_;
  std::span<const std::optional<float>> thresholds_;
  bool thresholds_known_;
  std::size_t voxel_bytes_;
  std::size_t channel_bytes_;   // of a subblock in one channel
  std::size_t subblock_bytes_;  // in all
  std::size_t group_count_;     // subblocks
  Spill& spill_;
  std::vector<std::uint64_t> keys_;  // of the group, as they came
  std::vector<std::byte> group_;     // their voxels, channel after channel, and the one that is looked at
  std::vector<std::size_t> order_;
  CutSubblocks cut_;
};

}  // namespace blockwalk
