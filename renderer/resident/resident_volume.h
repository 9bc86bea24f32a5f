// SPDX-License-Identifier: Apache-2.0
// A volume on the device. A part is absent until a frame needs it, then resident for as long as the volume lives:
//   records and voxels of a channel of a level
//                            - when a frame draws that channel of that level; with an apron (volume/file/apron.h)
//                            beside
//                              those without, each when a frame needs it;
//   its subblock masks       - when a frame culls by that channel on the level;
//   its visible cells        - the same, of the last few ranges;
//   block grid               - when a finder that looks blocks up in it is used on the level;
//   octree                   - when the octree finder is, over subblocks or, to count them, blocks;
//   ranges of macrocells     - when a finder first looks for what is active in cells of that size;
//   empty subblock           - when the channel is drawn without any skipping;
//   acceleration structures  - when the query finder is used on the level.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "renderer/find/acceleration.h"
#include "renderer/plan/plan.h"
#include "renderer/renderer.h"
#include "shaders/kernel_interface.h"
#include "volume/file/apron.h"

namespace blockwalk {

struct GridBuffers {
  glm::ivec3 tile_dims{0};
  Buffer tiles;
  Buffer cells;
};

struct OctreeBuffer {
  int depth = 1;
  Buffer nodes;
};

enum class OctreeLeaves : std::uint8_t { subblocks, blocks };

// Ranges of a channel in cells of some voxels (renderer/find/active_region.h).
struct Macrocells {
  Buffer ranges;  // GpuSubblock[], x fastest
  std::uint32_t occupied = 0;
};

// The cells that may show something in a range (renderer/resident/visible_cells.h).
struct ResidentCells {
  StoredRange range;
  Buffer cells;  // uint[2][], one a subblock
};

struct ResidentChannel {
  Buffer blocks;
  Buffer masks;                              // GpuSubblock[]
  std::vector<ResidentCells> visible_cells;  // the latest first
  std::map<int, Macrocells> macrocells;      // by their side, voxels
  Buffer empty;                              // voxels of one subblock that is empty everywhere
  std::vector<Buffer> voxel_chunks;          // equal but for the last; no block crosses from one to the next
  // What the masks are made of; nothing once they are.
  std::vector<gpu::GpuSubblock> ranges;
};

struct ResidentLevel {
  std::array<std::optional<ResidentChannel>, kMaxChannels> channels;  // by their number in the volume
  // Kept for building finders, which are the same for every channel: the blocks of whichever came first. Of several
  // channels the masks hold all bins, because none speaks for the others.
  Level records;
  std::vector<std::uint8_t> subblock_masks;  // of `records`, whose subblocks are dropped
  std::unique_ptr<GridBuffers> grid;
  std::array<std::unique_ptr<OctreeBuffer>, 2> octrees;  // by OctreeLeaves
  std::unique_ptr<AccelerationStructure> instances;
};

class VulkanVolume final : public ResidentVolume {
 public:
  VulkanVolume(Device& device, VolumeFile file, std::uint64_t chunk_bytes);

  // What `auto` was measured to mean for this volume (renderer/finder_probe.h); automatic: it was not.
  Finder fastest_finder = Finder::automatic;

  // Different for every volume of this process.
  std::uint64_t serial() const { return serial_; }
  const VolumeInfo& info() const override { return file_.info(); }
  std::uint64_t deviceBytes() const override;
  std::vector<ResidentPart> parts() const override;

  // Each makes its part resident if it is not. Throws DataError for the file, DeviceError for memory.
  // A level with at least these channels; the finders of a level with some channel.
  ResidentLevel& level(int number, Form form, bool apron, std::span<const std::size_t> channels);
  const Buffer& masks(ResidentChannel& channel);
  const Buffer& emptySubblock(ResidentChannel& channel, std::size_t number, bool apron);
  const GridBuffers& grid(ResidentLevel& level);
  const OctreeBuffer& octree(ResidentLevel& level, OctreeLeaves leaves);
  const AccelerationStructure& instances(ResidentLevel& level, const AccelerationStructure& unit_box);
  // Frees what query or grid looks in, on every level; it is built again when a view asks for it. No frame may be in
  // flight.
  void drop(Finder finder);

 private:
  using ReadBlocks = std::function<void(std::size_t first, std::size_t end, std::span<std::byte> out)>;

  void loadStored(int number, Form form, std::size_t channel, ResidentLevel& level);
  void loadWithApron(ApronLevel& apron, std::size_t channel, ResidentLevel& level);
  void upload(Level& records, std::size_t channel, std::uint64_t subblock_bytes, const ReadBlocks& read,
              ResidentLevel& level);

  Device& device_;
  std::uint64_t serial_;
  VolumeFile file_;
  std::uint64_t chunk_bytes_;
  std::vector<std::unique_ptr<ResidentLevel>>
      levels_;  // four a level: values and maxima, each without an apron and with one
};

}  // namespace blockwalk
