// SPDX-License-Identifier: Apache-2.0
// The renderer's door: a device, volumes resident on it, and frames. No Vulkan types here.
//
// One Renderer and its volumes belong to one thread, but for cancel flags, which any thread may set.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "view/view.h"
#include "volume/file/file.h"

namespace blockwalk {

// The driver refused: no device, out of memory, device lost. Not the fault of input.
struct DeviceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct DeviceOptions {
  std::string device;           // part of a name, or an index; empty: discrete, else integrated, else software
  bool allow_ray_query = true;  // false hides ray queries, so that `grid` serves everything
  bool validation = false;      // Khronos validation with synchronisation validation; messages go to `onMessage`
  std::uint64_t chunk_bytes = std::uint64_t{256} << 20;  // one allocation of voxels; lowered to what the device allows
  // Measure what the finder `auto` means on a software device too. Elsewhere it is measured for every volume. On
  // lavapipe a kernel that is tried takes about half a second to compile, and none was found that beats the grid by
  // much (docs/experiments).
  bool probe_software = false;
  double band_ms = 25;  // frames are cut into bands of about this device time
  // Of sums that refinements keep between their steps, all together (renderer/resident/kept_sums.h).
  std::uint64_t kept_sum_bytes = std::uint64_t{256} << 20;
  std::function<void(const std::string&)> on_message;  // validation messages and one-time notes
};

struct DeviceInfo {
  std::string name;
  std::string driver;
  std::string driver_version;
  std::string api_version;
  std::string kind;  // discrete, integrated, virtual, software
  bool ray_query = false;
  std::uint64_t memory_budget_bytes = 0;
  std::uint64_t memory_used_bytes = 0;  // by this renderer
};

// Every device that could be chosen, best first; for --help and messages.
std::vector<DeviceInfo> listDevices();

// The active region that the finders clusters and boundary look for (docs/finders.md), as it was last built.
struct FinderBuild {
  bool rebuilt = false;     // by this frame; else what follows is of an earlier one
  int cell_voxels = 0;      // side of a macrocell; 0 where the finder has none
  std::uint64_t cells = 0;  // macrocells of the level's box
  std::uint64_t active_cells = 0;
  std::uint64_t primitives = 0;  // triangles, or boxes
  std::uint64_t bytes = 0;       // on the device, without the macrocells' ranges
  // Wall times. Wald et al. 2021, Table 1: T_tf, T_tris (clusters: merging), T_BVH, T_total.
  double tf_ms = 0;
  double tris_ms = 0;
  double bvh_ms = 0;
  double total_ms = 0;
};

// Times and counts are of all samples that the frame shows, those of a refinement's earlier steps too.
struct RenderStats {
  double gpu_ms = 0;          // sum over the bands, by timestamp queries
  double total_ms = 0;        // wall time of the calls
  std::uint64_t rays = 0;     // pixels times samples
  std::uint64_t queries = 0;  // times the finder was asked
  std::uint64_t block_visits = 0;
  std::uint64_t subblock_visits = 0;
  std::uint64_t voxel_steps = 0;
  std::string finder;
  bool walk = true;
  bool cull = true;
  int level = 0;
  std::string kernel;  // the kernel key, readable
  std::uint64_t loop_bound_hits = 0;
  std::uint64_t non_finite = 0;
  FinderBuild finder_build{};
};

// Per pixel, row 0 at the top. `probes` is filled only when asked for; of several samples it holds the last.
struct Probe {
  std::int32_t x = -1, y = -1, z = -1;  // first-hit: voxel of the level drawn; -1 when nothing is hit
  std::uint32_t blocks = 0;             // blocks: how many blocks of the range the ray crosses
  float t = 0;                          // first-hit: world distance from the eye (orthographic: from the eye's plane)
};

struct Frame {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> pixels;  // straight rgba8, red in the lowest byte
  std::vector<Probe> probes;
  RenderStats stats;
  bool cancelled = false;  // then pixels and values are incomplete
  int samples_drawn = 0;   // a pixel, by this call: more than its step has where the sums had to be taken anew
  Output output = Output::color;
  // Instead of pixels, where output is not color, row by row: depth (1 a pixel, +infinity: nothing), position (3, NaN:
  // nothing), cost (1, whole numbers).
  std::vector<float> values{};
  // What a picture of the values runs over: x: the nearest and farthest depth of the volume's box that are before the
  // eye; the corners of its world box; nothing for cost.
  glm::dvec3 values_min{0};
  glm::dvec3 values_max{0};
};

constexpr std::uint64_t kSumBytes = 16;  // of a pixel's sum of samples
// A picture of more pixels keeps no sums: a refinement should draw all its samples in one step.
constexpr std::int64_t kMaxRefinedPixels = (std::int64_t{256} << 20) / static_cast<std::int64_t>(kSumBytes);

// A step of a refinement: the same view is drawn several times, each time with more of its samples, and the sums of
// those drawn before are kept. The picture is bit for bit that of `end` samples drawn at once, also where the sums were
// lost, to memory or to another view, and all samples are drawn again.
struct SampleStep {
  std::uint64_t owner = 0;  // whose sums; each owner refines one view at a time
  int begin = 0;            // samples that the owner's last step of this view ended with; 0: this is its first
  int end = 1;              // greater than `begin`, at most the view's samples
};

struct RenderOptions {
  bool count = true;   // fill the counters of RenderStats; off makes the kernel a little faster
  bool probe = false;  // fill Frame::probes
  // Draw with the one kernel that makes every choice at run time: the same picture, slower. For measuring what
  // specialisation is worth.
  bool general = false;
  // Build what clusters or boundary look for anew, as after a change of the range. For measuring what that takes.
  bool rebuild = false;
  const std::atomic<bool>* cancel = nullptr;  // looked at between bands, and between samples of one
  std::optional<SampleStep> step = {};        // none: all samples at once
};

// A piece of a volume on the device.
struct ResidentPart {
  std::string what;  // voxels, blocks, masks, cells, macrocells, empty, grid, octree, instances
  int level = 0;
  bool apron = false;  // of the level whose subblocks carry a ring (volume/file/apron.h)
  static constexpr int kAllChannels = -1;
  int channel = kAllChannels;  // of the volume
  std::uint64_t bytes = 0;
};

// A volume on the device. Levels and acceleration structures become resident when a frame first needs them.
class ResidentVolume {
 public:
  virtual ~ResidentVolume() = default;
  virtual const VolumeInfo& info() const = 0;
  virtual std::uint64_t deviceBytes() const = 0;
  virtual std::vector<ResidentPart> parts() const = 0;
};

class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual DeviceInfo device() const = 0;
  // Takes the file; the level that a default view shows becomes resident now, so that errors in it show now.
  // Throws DataError for the file, DeviceError for the device.
  virtual std::unique_ptr<ResidentVolume> load(VolumeFile file) = 0;
  // Throws ViewError for the view, DataError for a broken file, DeviceError for the device.
  virtual Frame render(ResidentVolume& volume, const View& view, const RenderOptions& options) = 0;
};

std::unique_ptr<Renderer> createRenderer(const DeviceOptions& options);

}  // namespace blockwalk
