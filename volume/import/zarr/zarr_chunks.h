// SPDX-License-Identifier: Apache-2.0
// The chunks of an array: which there are, and what those that are used hold, unpacked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "volume/import/chunked_source.h"
#include "volume/import/unpacking_room.h"
#include "volume/import/zarr/zarr_array.h"
#include "volume/import/zarr/zarr_objects.h"

namespace blockwalk {

// Throws DataError naming the object, the field and the bound.
class ZarrChunks final : public ChunkedSamples {
 public:
  // Keeps within `memory_bytes`, of which a chunk may be a quarter.
  ZarrChunks(std::shared_ptr<const ZarrStore> store, ZarrArray array, ArrayPart part, std::uint64_t memory_bytes);

  const ChunkLattice& lattice(std::size_t /*channel*/) const override { return chunks_; }
  ChunkLayout layout(std::size_t channel) const override;
  std::span<const std::byte> fill(std::size_t /*channel*/) const override { return array_.fill; }
  KeptBytes::Bytes chunk(std::size_t channel, glm::ivec3 cell) override;
  bool knowsBlank() const override { return present_.has_value(); }
  // Whether it is known that there are none.
  bool isAllFill() const { return present_ && present_->empty(); }
  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override;

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

  std::shared_ptr<const ZarrStore> store_;
  ZarrArray array_;
  ArrayPart part_;
  ChunkLattice chunks_;
  ChunkLattice objects_;
  glm::ivec3 object_chunks_{1};                        // along x, y and z
  std::size_t object_channel_cells_ = 1;               // and channels
  std::optional<std::vector<std::uint64_t>> present_;  // objects, ascending
  KeptBytes kept_;                                     // by number
  UnpackingRoom unpacking_;
  std::mutex shards_mutex_;
  std::size_t most_shards_ = 1;
  std::unordered_map<std::uint64_t, std::shared_ptr<const Shard>> shards_;  // a few that were used last
};

}  // namespace blockwalk
