// SPDX-License-Identifier: Apache-2.0
// A source over arrays that lie in chunks, each of which is unpacked for itself.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "volume/import/chunk_lattice.h"
#include "volume/import/convert/channel.h"
#include "volume/import/kept_bytes.h"
#include "volume/source.h"

namespace blockwalk {

// Where the samples of a chunk lie, in samples from its beginning: of its first voxel in a channel, and from one to the
// next along x, y and z.
struct ChunkLayout {
  std::size_t first = 0;
  glm::u64vec3 step{0};
};

// The layout of chunks of these sizes, whose axes `order` has from the one that changes last.
ChunkLayout layoutOf(const std::vector<std::uint64_t>& chunk, const std::vector<std::size_t>& order,
                     const ArrayPart& part, std::size_t channel);

// What the chunks of a volume hold. Threads may call at the same time. Throws DataError.
class ChunkedSamples {
 public:
  virtual ~ChunkedSamples() = default;
  virtual const ChunkLattice& lattice(std::size_t channel) const = 0;
  virtual ChunkLayout layout(std::size_t channel) const = 0;
  // One sample: what is where there is no chunk.
  virtual std::span<const std::byte> fill(std::size_t channel) const = 0;
  // Samples of the chunk in which the channel has this cell of its lattice; null where there is none.
  virtual KeptBytes::Bytes chunk(std::size_t channel, glm::ivec3 cell) = 0;
  // Whether it is known which chunks are there: then findRuns() has an answer.
  virtual bool knowsBlank() const = 0;
  // Where on x the box may hold something, as Source has it.
  virtual void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) = 0;
};

// Adds the runs of x in which `isPresent(cell)` says that the box may hold something; of a box with very many cells all
// of it.
template <typename IsPresent>
void addRuns(const ChunkLattice& lattice, const VoxelBox& box, IsPresent isPresent, std::vector<VoxelRun>& runs) {
  constexpr std::uint64_t kCellsLookedInto = 4096;
  const VoxelBox cells = lattice.cellsOf(box);
  const std::int64_t width = lattice.cellDims().x;
  if (cells.voxels() > kCellsLookedInto) return runs.push_back({.begin = box.begin.x, .end = box.end.x});
  for (int x = cells.begin.x; x < cells.end.x; ++x) {
    bool found = false;
    for (int z = cells.begin.z; z < cells.end.z && !found; ++z) {
      for (int y = cells.begin.y; y < cells.end.y && !found; ++y) found = isPresent(glm::ivec3(x, y, z));
    }
    if (!found) continue;
    runs.push_back({.begin = static_cast<int>(std::max<std::int64_t>(x * width, box.begin.x)),
                    .end = static_cast<int>(std::min<std::int64_t>((x + 1) * width, box.end.x))});
  }
}

// `info` has all but `blank`. Samples are of the converter's format, a single one a voxel.
std::unique_ptr<Source> makeChunkedSource(std::shared_ptr<ChunkedSamples> samples, ChannelConverter converter,
                                          SourceInfo info);

}  // namespace blockwalk
