// SPDX-License-Identifier: Apache-2.0
// Where the fields of NanoVDB files and grids lie, ABI 32, little endian, as NanoVDB.h has its structs. A file is a
// list of segments, or one grid alone:
//
//   segment   head (16) | of each grid: record (176), name | of each grid: its bytes, as they are or packed
//   grid      head (672) | tree (64) | root, its tiles | upper nodes (32^3) | lower nodes (16^3) | leaves (8^3)
//
// Nodes say where their children lie, in bytes from their own beginning; the tree says where the root does. Of a node
// of n^3 entries entry (x, y, z) is number (x * n + y) * n + z, a bit of its masks and a place in its table.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace blockwalk::nano {

constexpr std::string_view kMagic = "NanoVDB";  // a digit follows: 0 in old files, 1 of a grid, 2 of a segment
constexpr std::uint32_t kMajorVersion = 32;
constexpr std::uint32_t versionWord(std::uint32_t minor, std::uint32_t patch) {
  return kMajorVersion << 21 | minor << 10 | patch;
}
constexpr std::uint32_t majorOf(std::uint32_t version) { return version >> 21; }

enum class Codec : std::uint16_t { none = 0, zip = 1, blosc = 2 };

namespace segment {
constexpr std::size_t kVersion = 8;     // u32
constexpr std::size_t kGridCount = 12;  // u16
constexpr std::size_t kCodec = 14;      // u16
constexpr std::size_t kBytes = 16;
}  // namespace segment

// Of one grid in a segment.
namespace record {
constexpr std::size_t kGridBytes = 0;     // u64
constexpr std::size_t kFileBytes = 8;     // u64
constexpr std::size_t kNameHash = 16;     // u64
constexpr std::size_t kVoxels = 24;       // u64
constexpr std::size_t kType = 32;         // u32
constexpr std::size_t kClass = 36;        // u32
constexpr std::size_t kWorldBox = 40;     // 6 f64
constexpr std::size_t kIndexBox = 88;     // 6 i32
constexpr std::size_t kVoxelSize = 112;   // 3 f64
constexpr std::size_t kNameBytes = 136;   // u32, with a NUL
constexpr std::size_t kNodeCounts = 140;  // 4 u32: leaves, lower, upper, root
constexpr std::size_t kTileCounts = 156;  // 3 u32
constexpr std::size_t kCodec = 168;       // u16
constexpr std::size_t kVersion = 172;     // u32
constexpr std::size_t kBytes = 176;
}  // namespace record

namespace grid {
constexpr std::size_t kChecksum = 8;    // u64, all ones: none
constexpr std::size_t kVersion = 16;    // u32
constexpr std::size_t kFlags = 20;      // u32
constexpr std::size_t kNumber = 24;     // u32
constexpr std::size_t kCount = 28;      // u32
constexpr std::size_t kGridBytes = 32;  // u64
constexpr std::size_t kName = 40;       // 256, with a NUL
constexpr std::size_t kNameBytes = 256;
constexpr std::size_t kMapFloats = 296;    // 9 of the matrix by rows, 9 of its inverse, 3, 1: f32
constexpr std::size_t kMatrix = 384;       // 9 f64, by rows
constexpr std::size_t kInverse = 456;      // 9 f64
constexpr std::size_t kTranslation = 528;  // 3 f64
constexpr std::size_t kTaper = 552;        // f64
constexpr std::size_t kWorldBox = 560;     // 6 f64
constexpr std::size_t kVoxelSize = 608;    // 3 f64
constexpr std::size_t kClass = 632;        // u32
constexpr std::size_t kType = 636;         // u32
constexpr std::size_t kBlindOffset = 640;  // i64
constexpr std::size_t kBytes = 672;
constexpr std::uint32_t kBreadthFirst = 1u << 5;  // of the flags
constexpr std::uint32_t kHasBox = 1u << 1;
constexpr std::uint32_t kHasRange = 1u << 2;
}  // namespace grid

namespace tree {
constexpr std::size_t kNodeOffsets = 0;  // 4 u64: leaves, lower, upper, root
constexpr std::size_t kNodeCounts = 32;  // 3 u32
constexpr std::size_t kTileCounts = 44;  // 3 u32
constexpr std::size_t kVoxels = 56;      // u64
constexpr std::size_t kBytes = 64;
}  // namespace tree

enum class Type : std::uint32_t {
  f32 = 1,
  f64 = 2,
  i16 = 3,
  i32 = 4,
  i64 = 5,
  vec3f = 6,
  vec3d = 7,
  mask = 8,
  half = 9,
  u32 = 10,
  boolean = 11,
  rgba8 = 12,
  fp4 = 13,
  fp8 = 14,
  fp16 = 15,
  fpn = 16,
  vec4f = 17,
  vec4d = 18,
  u8 = 26
};
constexpr std::array<std::string_view, 27> kTypeNames = {
    "unknown", "float",  "double",  "int16",     "int32",       "int64",      "Vec3f",   "Vec3d",   "Mask",
    "Half",    "uint32", "bool",    "RGBA8",     "Float4",      "Float8",     "Float16", "FloatN",  "Vec4f",
    "Vec4d",   "Index",  "OnIndex", "IndexMask", "OnIndexMask", "PointIndex", "Vec3u8",  "Vec3u16", "uint8"};
constexpr std::array<std::string_view, 10> kClassNames = {"",           "level set",  "fog volume", "staggered vectors",
                                                          "points",     "points",     "topology",   "voxels",
                                                          "index grid", "tensor grid"};
constexpr std::uint32_t kLevelSetClass = 1;
constexpr std::uint32_t kFogClass = 2;
constexpr std::uint32_t kVoxelsClass = 7;

constexpr std::size_t aligned(std::size_t at, std::size_t to) { return (at + to - 1) / to * to; }

// Sides of the nodes below the root: upper, lower, leaf.
constexpr std::array<int, 3> kNodeLog2{5, 4, 3};
constexpr std::array<int, 3> kNodeVoxelsLog2{12, 7, 3};  // of all that a node covers

// Fields whose places depend on what a value is: bytes, and to what it is aligned; the same of means and deviations.
struct ValueSizes {
  std::size_t bytes = 4;
  std::size_t align = 4;
  std::size_t mean_bytes = 4;
};

struct NodeLayout {
  std::size_t value_mask = 0;
  std::size_t child_mask = 0;
  std::size_t range = 0;  // least, greatest, mean, deviation
  std::size_t table = 0;
  std::size_t entry = 8;
  std::size_t bytes = 0;
};

struct Layout {
  ValueSizes value;
  // root
  std::size_t background = 0;
  std::size_t mean = 0;
  std::size_t root_bytes = 0;
  std::size_t tile_value = 0;  // key (u64), child (i64), state (u32), value
  std::size_t tile_bytes = 0;
  NodeLayout upper;
  NodeLayout lower;
  // leaf: least (3 i32), sides less one (3 u8), flags (u8), mask, range, table
  std::size_t leaf_range = 80;
  std::size_t leaf_table = 96;
  std::size_t leaf_bytes = 96;
};

namespace root {
constexpr std::size_t kBox = 0;         // 6 i32
constexpr std::size_t kTileCount = 24;  // u32
constexpr std::size_t kTileChild = 8;   // in a tile
constexpr std::size_t kTileState = 16;
}  // namespace root

namespace leaf {
constexpr std::size_t kOrigin = 0;
constexpr std::size_t kSides = 12;
constexpr std::size_t kFlags = 15;
constexpr std::size_t kMask = 16;
constexpr std::size_t kQuantumLeast = 80;  // of packed floats: f32, and the step behind it
constexpr std::size_t kBitTable = 80;      // of booleans
}  // namespace leaf

constexpr std::size_t rangeEnd(std::size_t begin, const ValueSizes& value) {
  return aligned(begin + 2 * value.bytes, value.mean_bytes) + 2 * value.mean_bytes;
}

constexpr NodeLayout nodeLayout(int log2, const ValueSizes& value) {
  const std::size_t entries = std::size_t{1} << (3 * log2);
  NodeLayout node;
  node.value_mask = 32;
  node.child_mask = node.value_mask + entries / 8;
  node.range = node.child_mask + entries / 8;
  node.table = aligned(rangeEnd(node.range, value), 32);
  node.entry = std::max<std::size_t>(aligned(value.bytes, 8), 8);
  node.bytes = node.table + entries * node.entry;
  return node;
}

// `leaf_table_bytes`: of the values of a leaf.
constexpr Layout layoutOf(const ValueSizes& value, std::size_t leaf_table_bytes) {
  Layout layout;
  layout.value = value;
  layout.background = aligned(28, value.align);
  layout.mean = aligned(layout.background + 3 * value.bytes, value.mean_bytes);
  layout.root_bytes = aligned(layout.mean + 2 * value.mean_bytes, 32);
  layout.tile_value = aligned(20, value.align);
  layout.tile_bytes = aligned(layout.tile_value + value.bytes, 32);
  layout.upper = nodeLayout(kNodeLog2[0], value);
  layout.lower = nodeLayout(kNodeLog2[1], value);
  layout.leaf_table = aligned(rangeEnd(layout.leaf_range, value), 32);
  layout.leaf_bytes = layout.leaf_table + leaf_table_bytes;
  return layout;
}

}  // namespace blockwalk::nano
