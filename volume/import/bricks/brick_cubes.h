// SPDX-License-Identifier: Apache-2.0
// Cubes of bricks in hierarchical Z order, in rows as everybody reads them; those used last stay in memory.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "volume/import/bricks/prism_metadata.h"
#include "volume/import/kept_bytes.h"

namespace blockwalk {

// The files of bricks, of which a few are open at a time. Threads may call at the same time.
class BrickFiles {
 public:
  // `metadata` must outlive it.
  BrickFiles(std::shared_ptr<const InputFile> header, const PrismMetadata& metadata)
      : header_(std::move(header)), metadata_(metadata) {}

  // Throws DataError unless the file lies beside the header and has the brick's voxels and nothing else.
  std::shared_ptr<const InputFile> open(const Brick& brick);

 private:
  std::shared_ptr<const InputFile> header_;
  const PrismMetadata& metadata_;
  std::mutex mutex_;
  std::unordered_map<std::uint64_t, std::shared_ptr<const InputFile>> open_;  // by code
};

// Threads may call at the same time.
class BrickCubes {
 public:
  using Cube = KeptBytes::Bytes;  // x fastest, in the file's byte order

  // Keeps cubes of so many bytes in all. `metadata` and `files` must outlive it.
  BrickCubes(const PrismMetadata& metadata, BrickFiles& files, std::uint64_t memory_bytes);

  // Side of the cubes that a brick is cut into: larger ones take fewer reads, and smaller ones less memory for rows.
  int sideOf(const Brick& brick) const;
  // The cube that holds a voxel of the brick.
  Cube get(const Brick& brick, glm::ivec3 voxel);

 private:
  Cube read(const Brick& brick, glm::ivec3 first) const;

  const PrismMetadata& metadata_;
  BrickFiles& files_;
  int side_ = 0;
  KeptBytes kept_;  // by Morton code of the first voxel
};

}  // namespace blockwalk
