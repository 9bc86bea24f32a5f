// SPDX-License-Identifier: Apache-2.0
// A plane of a volume as a picture's worth of values, exact: which voxels it is made of, read from the file. No
// Vulkan. Data flows so:
//
//   SliceCut       what is asked for: along an axis, or any plane
//       | planSlice(): the level, the pixels and where they lie
//   SlicePlan
//       | SliceReader: blocks of the level, a few a step
//   SlicePixels    stored units
//       | slice_bytes.h: a file of values; protocol/slice_picture.h: a picture
//
// Pixels of a cut along an axis are whole voxels of its level, in the file's order: row 0 and column 0 are the least
// indices. Columns and rows are x and y of a cut along z, x and z along y, y and z along x.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "volume/error.h"
#include "volume/volume.h"
#include "volume/voxel_box.h"

namespace blockwalk {

// What a pixel has of the voxels through a slab. Values that are not finite count in none of them. Of colours: the one
// of most or of least opacity, the first of equals; or the mean, of red, green and blue weighted by opacity.
enum class SliceReduce : std::uint8_t { max, min, mean };

constexpr int kAutoSliceLevel = -1;
constexpr int kAutoSliceSide = 2048;  // pixels of a picture whose level is left to choose
constexpr int kMaxSliceSide = 8192;
constexpr std::uint64_t kMaxSliceBytes = std::uint64_t{256} << 20;  // 4 a pixel and channel
constexpr std::uint64_t kMaxSliceSamples = std::uint64_t{1} << 32;  // voxels that are looked at, of all channels
constexpr std::uint64_t kMaxSliceBlocks = std::uint64_t{1} << 18;   // reads of blocks, of all channels
constexpr int kSliceSquare = 64;  // pixels a side of a plane that are made together, so that blocks are read few times

// Voxels of level 0. The slab is `thickness` voxels from index - (thickness - 1) / 2 on, as far as the volume goes.
struct AxisCut {
  int axis = 2;
  int index = 0;
  int thickness = 1;
  std::optional<VoxelBox> box = std::nullopt;  // of the two other axes; else all of them
  bool operator==(const AxisCut&) const = default;
};

// World space. `right` and `down` have any length but 0; down is made perpendicular to right. The slab is `thickness`
// deep, half of it to each side, and 0 is the plane alone.
struct PlaneCut {
  glm::dvec3 centre{0};
  glm::dvec3 right{1, 0, 0};
  glm::dvec3 down{0, 1, 0};
  double pixel = 1;  // its side
  int width = 512;
  int height = 512;
  double thickness = 0;
  bool is_linear = false;  // between voxel centres; else the voxel that a sample lies in
  bool operator==(const PlaneCut&) const = default;
};

struct SliceCut {
  std::variant<AxisCut, PlaneCut> plane;
  SliceReduce reduce = SliceReduce::max;
  // Chosen: along an axis the finest whose picture has at most kAutoSliceSide pixels a side; of a plane the coarsest
  // whose voxels are no larger than a pixel.
  int level = kAutoSliceLevel;
  std::vector<int> channels = {};  // in this order; else all
  bool operator==(const SliceCut&) const = default;
};

struct SlicePlan {
  int level = 0;
  Form form = Form::values;  // maxima: of a slab's maximum, where the level has them
  SliceReduce reduce = SliceReduce::max;
  int width = 0;
  int height = 0;
  std::vector<int> channels = {};
  // The picture in the world: its first pixel's corner, one pixel to the right and down, and through the slab.
  glm::dvec3 corner{0};
  glm::dvec3 right{0};
  glm::dvec3 down{0};
  glm::dvec3 through{0};

  // Along an axis: voxels of the level, and of level 0 from which to which the slab goes. Of a plane: -1.
  int axis = -1;
  VoxelBox box = {};
  int first = 0;
  int last = 0;
  // Of a plane: samples through the slab.
  int samples = 1;
  bool is_linear = false;

  // Axes of the columns and rows.
  int columnAxis() const { return axis == 0 ? 1 : 0; }
  int rowAxis() const { return axis == 2 ? 1 : 2; }
  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};

// What the volume has not, or what is too much: `field` is the member that is to blame.
struct SliceError : DataError {
  SliceError(std::string member, const std::string& detail)
      : DataError(member + ": " + detail), field(std::move(member)) {}
  std::string field;
};

// Throws SliceError.
SlicePlan planSlice(const VolumeInfo& info, const SliceCut& cut);

struct SlicePixels {
  // Scalars: a picture a channel of the plan, stored units; not a number outside of the volume, and where no value of
  // the slab is finite. A slab of one voxel has what is stored, bit for bit.
  std::vector<std::vector<float>> values;
  std::vector<std::uint32_t> colors;  // rgba8, red in the lowest byte; 0 outside of the volume
};

}  // namespace blockwalk
