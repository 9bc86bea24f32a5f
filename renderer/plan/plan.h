// SPDX-License-Identifier: Apache-2.0
// plan(): from a view, a volume and a device to the kernel that draws it and what must be resident. Pure.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "renderer/plan/kernel_key.h"
#include "renderer/plan/need.h"
#include "view/resolved_view.h"

namespace blockwalk {

// As views name it: auto, query, grid, ...
std::string_view finderName(Finder finder);

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct DeviceTraits {
  bool ray_query = false;
  bool software = true;
  std::uint64_t max_instances = 0;
  Finder fastest = Finder::automatic;  // query or grid, where that was measured for the volume
  // Voxels of a level that take more are paged: they come and go block by block. 0: none are.
  std::uint64_t page_above_bytes = 0;
  std::uint64_t page_room_bytes = 0;  // for all of them
  // Records of a paged level that take more are read by windows (renderer/plan/level_window.h). 0: none are.
  std::uint64_t record_room_bytes = 0;
  // A window of so many blocks has found no room: `auto` takes a level whose window has fewer.
  std::uint64_t most_window_cells = std::numeric_limits<std::uint64_t>::max();
  // The finest level of the volume that `auto` takes: what finer ones need besides voxels has found no room.
  int finest_level = 0;
};

// A channel that can be seen.
struct ChannelPlan {
  std::size_t channel = 0;  // of the volume
  StoredRange range;
  std::uint8_t range_mask = 0;  // bins that the range meets
};

// A coarser level, of which is drawn what is far away, or blocks whose voxels are absent.
struct CoarsePlan {
  int level = 0;
  Form form = Form::values;
  bool paged = false;
  BlockWindow window{};        // whose records are there
  bool is_walked = false;      // by rays; else it is there for absent voxels alone
  double depth = kInfinity;    // before the eye, from which on it is
  double transmittance = 0;    // of which a ray has less left, from where it is
  std::size_t first_need = 0;  // in Plan::needs, up to those of the next one
};

struct Plan {
  KernelKey key;
  int level = 0;
  bool is_coarser = false;            // than the view wants, for want of room
  Form form = Form::values;           // of the level: maxima for mip where there are some
  BlockWindow window{};               // of the level, whose records are there
  int macrocell_voxels = 0;           // clusters and boundary: side of a macrocell
  std::vector<ChannelPlan> channels;  // of those drawn, ascending, those that show something
  std::vector<ClipPlane> planes;      // world
  bool apron = false;                 // voxels with the apron around every subblock
  // Those that are drawn farther away come first, the finest of them first.
  std::vector<CoarsePlan> coarse;
  // Paged: which of them is resident as a whole, and drawn where voxels of others, or of the plan's own, are absent.
  std::optional<std::size_t> stand_in = {};
  // What one is made of comes before it: of the plan's own level first, then of each coarser one, and at last what
  // stands in for the blocks of paged ones.
  std::vector<Need> needs;
  KernelWish kernel = KernelWish::best;
  bool is_blank = false;  // nothing can be seen: no kernel at all, only background

  bool isPaged() const { return stand_in.has_value(); }
  bool isMixed() const { return key.mixed != 0; }
  std::size_t farCount() const;
  int farLevel() const { return farCount() == 0 ? level : coarse[farCount() - 1].level; }
  bool asksFor(Part part) const;
  bool asksForRegion() const { return asksFor(Part::clusters) || asksFor(Part::boundary); }
  bool queriesRays() const { return asksFor(Part::instances) || asksForRegion(); }
};

// `count` and `probe` as in FrameOrder. Throws ViewError where the device cannot do what is
// asked.
Plan plan(const ResolvedView& view, const VolumeInfo& info, const DeviceTraits& device, bool count, bool probe);

// Whether rays start from what is seen, which go wherever light comes from (docs/integration.md).
bool hasSecondaryRays(const ResolvedView& view);
// Whether rays are others than those through the pixels' places from the eye.
bool hasLens(const ResolvedView& view);

// Whether the finder's tiles of blocks, if it looks blocks up in them, can be counted on the level.
bool canUse(Finder finder, const VolumeInfo& info, int level);

// A channel's range in the view and, for scalars in blend and first-hit, what its transfer function shows, without
// empty voxels.
StoredRange visibleRange(const ResolvedView& view, const VolumeInfo& info, std::size_t number);

}  // namespace blockwalk
