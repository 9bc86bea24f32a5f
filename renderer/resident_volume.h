// SPDX-License-Identifier: Apache-2.0
// A volume on the device. A part is absent until a frame needs it, then resident for as long as the volume lives:
//   level records and voxels - when a frame draws that level; with an apron (volume/apron.h) beside those without, each
//                              when a frame needs it;
//   subblock masks            - when a frame culls on the level;
//   block grid                - when the grid finder is used on the level;
//   acceleration structures   - when the query finder is used on the level.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "renderer/acceleration.h"
#include "renderer/renderer.h"

namespace blockwalk {

struct GridBuffers {
  glm::ivec3 tile_dims{0};
  Buffer tiles;
  Buffer cells;
};

struct ResidentLevel {
  Level records;  // kept for building finders and masks; voxels live on the device only
  Buffer blocks;
  Buffer masks;                      // GpuSubblock[]
  std::vector<Buffer> voxel_chunks;  // equal but for the last; no block crosses from one to the next
  std::unique_ptr<GridBuffers> grid;
  std::unique_ptr<AccelerationStructure> instances;
};

class VulkanVolume final : public ResidentVolume {
 public:
  VulkanVolume(Device& device, VolumeFile file, std::uint64_t chunk_bytes);

  // Different for every volume of this process.
  std::uint64_t serial() const { return serial_; }
  const VolumeInfo& info() const override { return file_.info(); }
  std::uint64_t deviceBytes() const override;
  std::vector<ResidentPart> parts() const override;

  // Each makes its part resident if it is not. Throws DataError for the file, DeviceError for memory.
  ResidentLevel& level(int number, bool apron);
  const Buffer& masks(int number, bool apron);
  const GridBuffers& grid(int number, bool apron);
  const AccelerationStructure& instances(int number, bool apron, const AccelerationStructure& unit_box);

 private:
  using ReadBlocks = std::function<void(std::size_t first, std::size_t end, std::span<std::byte> out)>;

  std::unique_ptr<ResidentLevel> loadStored(int number);
  std::unique_ptr<ResidentLevel> loadWithApron(int number);
  void uploadLevel(ResidentLevel& level, std::uint64_t subblock_bytes, const ReadBlocks& read);

  Device& device_;
  std::uint64_t serial_;
  VolumeFile file_;
  std::uint64_t chunk_bytes_;
  std::vector<std::unique_ptr<ResidentLevel>> levels_;  // two a level: without an apron, with one
};

}  // namespace blockwalk
