// SPDX-License-Identifier: Apache-2.0
// The chunks of datasets, read and unpacked by ourselves from where libhdf5 says that they lie.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "volume/import/chunked_source.h"
#include "volume/import/hdf5/hdf5_file.h"
#include "volume/import/unpacking_room.h"

namespace blockwalk {

// A dataset, and the part of it that is wanted.
struct Hdf5Dataset {
  std::string path = {};
  Hdf5Array array = {};
  ArrayPart part = {};
};

// One dataset with all channels, or one a channel. Throws DataError naming file and dataset: for types, layouts and
// filters that cannot be read, for chunks that are too large for the memory or lie outside the file.
class Hdf5Chunks final : public ChunkedSamples {
 public:
  // Asks `file` where the chunks lie, and needs it no more. Keeps within `memory_bytes`, of which a chunk may be a
  // quarter.
  Hdf5Chunks(Hdf5File& file, std::vector<Hdf5Dataset> datasets, std::uint64_t memory_bytes);

  const ChunkLattice& lattice(std::size_t channel) const override { return at(channel).lattice; }
  ChunkLayout layout(std::size_t channel) const override;
  std::span<const std::byte> fill(std::size_t channel) const override { return at(channel).dataset.array.fill; }
  KeptBytes::Bytes chunk(std::size_t channel, glm::ivec3 cell) override;
  bool knowsBlank() const override { return knows_blank_; }
  // Whether no chunk is there.
  bool isAllFill() const;
  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override;

 private:
  struct Cells {
    Hdf5Dataset dataset;
    std::vector<std::uint64_t> chunk;  // by axis; what is not chunked is cut into pieces
    ChunkLattice lattice;
    bool is_everywhere = false;            // it lies in one run of bytes, from `offset` or in `bytes`
    std::vector<std::uint64_t> present{};  // numbers of chunks that are there, ascending
    std::vector<Hdf5Place> places{};       // of those
    std::vector<std::byte> bytes{};        // of a compact dataset
  };

  static std::vector<Cells> cellsOf(Hdf5File& file, std::vector<Hdf5Dataset> datasets, std::uint64_t memory_bytes);
  static void findChunks(Hdf5File& file, Cells& cells, std::uint64_t most);
  const Cells& at(std::size_t channel) const { return cells_[cells_.size() > 1 ? channel : 0]; }
  std::size_t channelCell(std::size_t channel) const;
  KeptBytes::Bytes readRun(const Cells& cells, const std::vector<std::uint64_t>& numbers);
  KeptBytes::Bytes unpack(const Cells& cells, const Hdf5Place& place, const std::vector<std::uint64_t>& numbers);

  std::shared_ptr<const InputFile> file_;
  std::vector<Cells> cells_;
  bool knows_blank_ = false;
  KeptBytes kept_;
  UnpackingRoom unpacking_;
};

}  // namespace blockwalk
