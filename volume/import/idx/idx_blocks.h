// SPDX-License-Identifier: Apache-2.0
// The samples of an OpenVisus volume: blocks of files, and boxes in rows that are gathered from them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "volume/import/idx/idx_header.h"
#include "volume/import/kept_bytes.h"

namespace blockwalk {

// Threads may call at the same time. Throws DataError naming the file of blocks, the block, the field and the bound.
class IdxBlocks {
 public:
  // `header` must outlive it. Keeps blocks and boxes of so many bytes in all. Throws for blocks that the memory does
  // not hold.
  IdxBlocks(std::shared_ptr<const InputFile> file, const IdxHeader& header, std::uint64_t memory_bytes);

  // Voxels along each axis of the boxes that the volume is cut into, beginning at its coordinates' origin.
  glm::ivec3 boxDims() const { return box_dims_; }
  // The samples of one field in the box that holds this voxel, x fastest; default values where no block is there.
  KeptBytes::Bytes box(std::size_t field, glm::ivec3 voxel);

 private:
  KeptBytes::Bytes readBox(std::size_t field, std::uint64_t first_code);
  void readRun(std::size_t field, std::uint64_t address, std::span<std::byte> out);
  KeptBytes::Bytes readBlock(std::size_t field, std::uint64_t block);
  std::shared_ptr<const InputFile> open(const std::string& name);
  void fillDefault(std::size_t field, std::span<std::byte> out) const;
  void orderRows(std::uint64_t block, std::vector<std::byte>& samples);

  std::shared_ptr<const InputFile> file_;
  const IdxHeader& header_;
  std::size_t width_;  // bytes of a voxel in one field
  int box_bits_ = 0;   // of a code
  glm::ivec3 box_dims_{1};
  std::vector<std::uint32_t> box_rows_;  // where a voxel of a box lies in its rows, by the low bits of its code
  KeptBytes blocks_;                     // by field and number
  KeptBytes boxes_;                      // by field and code
  std::mutex files_mutex_;
  std::unordered_map<std::string, std::shared_ptr<const InputFile>> files_;  // a few that were opened last
};

}  // namespace blockwalk
