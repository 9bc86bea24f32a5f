// SPDX-License-Identifier: Apache-2.0
// The chunks of an array: which there are, and what those that are used hold, unpacked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <semaphore>
#include <unordered_map>
#include <vector>

#include "volume/import/kept_bytes.h"
#include "volume/import/zarr/zarr_array.h"
#include "volume/import/zarr/zarr_objects.h"
#include "volume/source.h"

namespace blockwalk {

// Where the samples of a chunk lie, in samples from its beginning: of its first voxel in a channel, and from one to the
// next along x, y and z.
struct ChunkLayout {
  std::size_t first = 0;
  glm::u64vec3 step{0};
};

// Threads may call at the same time. Throws DataError naming the object, the field and the bound.
class ZarrChunks {
 public:
  // Keeps within `memory_bytes`, of which a chunk may be a quarter.
  ZarrChunks(std::shared_ptr<const ZarrStore> store, ZarrArray array, ZarrPart part, std::uint64_t memory_bytes);

  const ZarrArray& array() const { return array_; }
  const ZarrPart& part() const { return part_; }
  const ZarrLattice& lattice() const { return chunks_; }
  ChunkLayout layout(std::size_t channel) const;
  // Samples of the chunk in which the channel has this cell of the lattice; null where there is none and all is fill.
  KeptBytes::Bytes chunk(std::size_t channel, glm::ivec3 cell);

  // Whether it is known which objects are there: then findRuns() has an answer.
  bool knowsBlank() const { return present_.has_value(); }
  // Whether it is known that there are none.
  bool isAllFill() const { return present_ && present_->empty(); }
  // Where on x the box may hold something, as Source has it.
  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs);

 private:
  struct Shard {
    std::shared_ptr<const ZarrObject> object;  // null: there is none
    std::vector<std::uint64_t> index;          // offset and bytes of each chunk
  };
  struct Place {
    std::uint64_t offset = 0;
    std::uint64_t bytes = 0;
  };

  KeptBytes::Bytes read(std::size_t channel_cell, glm::ivec3 cell);
  KeptBytes::Bytes unpack(const ZarrObject& object, Place place, const std::string& name);
  std::shared_ptr<const Shard> shard(std::size_t channel_cell, glm::ivec3 object_cell);
  std::shared_ptr<const Shard> readShard(const std::string& key) const;
  // Nothing where the shard lacks it.
  std::optional<Place> placeIn(const Shard& shard, const std::vector<std::uint64_t>& numbers,
                               const std::string& name) const;
  bool isPresent(std::size_t channel_cell, glm::ivec3 cell);
  bool hasObject(std::uint64_t number) const;
  bool anyObject(std::size_t channel_cell, const VoxelBox& cells) const;

  std::shared_ptr<const ZarrStore> store_;
  ZarrArray array_;
  ZarrPart part_;
  ZarrLattice chunks_;
  ZarrLattice objects_;
  glm::ivec3 object_chunks_{1};                        // along x, y and z
  std::size_t object_channel_cells_ = 1;               // and channels
  std::optional<std::vector<std::uint64_t>> present_;  // objects, ascending
  KeptBytes kept_;                                     // by number
  std::counting_semaphore<> unpacking_;                // as many at a time as there is memory for
  std::mutex shards_mutex_;
  std::size_t most_shards_ = 1;
  std::unordered_map<std::uint64_t, std::shared_ptr<const Shard>> shards_;  // a few that were used last
};

}  // namespace blockwalk
