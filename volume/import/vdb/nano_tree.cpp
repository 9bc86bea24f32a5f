// SPDX-License-Identifier: Apache-2.0
#include "volume/import/vdb/nano_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "volume/error.h"
#include "volume/formats/nano_layout.h"
#include "volume/import/header_bytes.h"

namespace blockwalk {
namespace {

using nano::Type;

// What the values of a type are here, and in the file.
struct NanoValues {
  SampleFormat format;
  nano::ValueSizes sizes;
  std::size_t table_bytes = 0;  // of a leaf
};

std::optional<NanoValues> valuesOf(Type type) {
  const auto single = [](SampleType sample, std::size_t mean) {
    const std::size_t bytes = sampleBytes(sample);
    return NanoValues{{.type = sample, .channels = 1}, {bytes, bytes, mean}, kLeafVoxels * bytes};
  };
  const auto vector = [](SampleType sample, int channels) {
    const std::size_t bytes = sampleBytes(sample);
    const std::size_t all = bytes * static_cast<std::size_t>(channels);
    return NanoValues{{.type = sample, .channels = channels}, {all, bytes, bytes}, kLeafVoxels * all};
  };
  const auto packed = [](std::size_t bits) {
    return NanoValues{{.type = SampleType::f32, .channels = 1}, {4, 4, 4}, kLeafVoxels * bits / 8};
  };
  switch (type) {
    case Type::f32:
      return single(SampleType::f32, 4);
    case Type::f64:
      return single(SampleType::f64, 8);
    case Type::i16:
      return single(SampleType::i16, 4);
    case Type::i32:
      return single(SampleType::i32, 4);
    case Type::i64:
      return single(SampleType::i64, 8);
    case Type::u32:
      return single(SampleType::u32, 4);
    case Type::u8:
      return single(SampleType::u8, 4);
    case Type::vec3f:
      return vector(SampleType::f32, 3);
    case Type::vec3d:
      return vector(SampleType::f64, 3);
    case Type::vec4f:
      return vector(SampleType::f32, 4);
    case Type::vec4d:
      return vector(SampleType::f64, 4);
    case Type::rgba8:
      return NanoValues{{.type = SampleType::u8, .channels = 4}, {4, 4, 4}, kLeafVoxels * 4};
    case Type::mask:
    case Type::boolean:
      return NanoValues{{.type = SampleType::u8, .channels = 1}, {1, 1, 1}, 0};
    case Type::fp4:
      return packed(4);
    case Type::fp8:
      return packed(8);
    case Type::fp16:
      return packed(16);
    case Type::fpn:
      return packed(0);  // of each leaf its own
    case Type::half:
      break;
  }
  return std::nullopt;
}

HeaderBytes numbers(std::span<const std::byte> bytes) { return {bytes, std::endian::little}; }

template <std::size_t N, typename Names>
std::string_view nameOf(std::uint32_t number, const std::array<Names, N>& names) {
  return number < N ? names[number] : "unknown";
}

// Walks a tree of values of one type.
class NanoTree {
 public:
  NanoTree(NanoBytes& bytes, Type type, bool is_level_set)
      : bytes_(bytes),
        type_(type),
        values_(*valuesOf(type)),
        layout_(nano::layoutOf(values_.sizes, values_.table_bytes)),
        inside_only_(is_level_set) {
    if (type_ == Type::boolean) layout_.leaf_bytes = 160;
    const HeaderBytes tree = numbers(bytes_.get(nano::grid::kBytes, nano::tree::kBytes));
    const std::uint64_t offset = tree.u64(nano::tree::kNodeOffsets + 3 * 8);
    root_ = nano::grid::kBytes + std::min(offset, bytes_.size());
    tile_count_ = numbers(bytes_.get(root_, layout_.root_bytes)).u32(nano::root::kTileCount);
    if (tile_count_ > bytes_.size() / layout_.tile_bytes) {
      bytes_.fail(fmt::format("root: {} tiles are declared, it has {} bytes", tile_count_, bytes_.size()));
    }
  }

  std::vector<std::byte> background() {
    // Of a fog, what is not active is nothing.
    const bool is_fog = numbers(bytes_.get(0, nano::grid::kBytes)).u32(nano::grid::kClass) == nano::kFogClass;
    if (is_fog || inside_only_ || type_ == Type::mask) return std::vector<std::byte>(values_.format.voxelBytes());
    const auto value = bytes_.get(root_ + layout_.background, values_.sizes.bytes);
    return {value.begin(), value.end()};
  }

  void read(SparseGrid& grid) {
    if (inside_only_) findLeast();
    walk(
        [&](glm::ivec3 origin, int log2_side, bool is_active, std::span<const std::byte> value) {
          if (!isOn(is_active, value)) return;
          const bool is_one = inside_only_ || type_ == Type::mask;
          grid.addTile(origin, log2_side, is_one ? std::span<const std::byte>(one_).first(value.size()) : value);
        },
        [&](glm::ivec3 origin, std::span<const std::byte> leaf) { addLeaf(origin, leaf, grid); });
  }

 private:
  // tile(origin, log2_side, is_active, value), leaf(origin, bytes); values are good until the next call.
  template <typename Tile, typename Leaf>
  void walk(const Tile& tile, const Leaf& leaf) {
    visits_ = {};
    std::vector<std::byte> value(values_.sizes.bytes);
    for (std::uint32_t i = 0; i < tile_count_; ++i) {
      const std::uint64_t at = root_ + layout_.root_bytes + std::uint64_t{i} * layout_.tile_bytes;
      const HeaderBytes entry = numbers(bytes_.get(at, layout_.tile_bytes));
      const std::uint64_t key = entry.u64(0);
      constexpr std::uint64_t kPart = (1 << 21) - 1;
      const auto place = [&](int shift) {
        return static_cast<std::int32_t>(static_cast<std::uint32_t>(key >> shift & kPart) << nano::kNodeVoxelsLog2[0]);
      };
      const glm::ivec3 origin(place(42), place(21), place(0));
      const std::int64_t child = entry.i64(nano::root::kTileChild);
      const bool is_active = entry.u32(nano::root::kTileState) != 0;
      if (child != 0) {
        walkNode<0>(childOf(root_, child), origin, tile, leaf);
        continue;
      }
      std::ranges::copy(bytes_.get(at + layout_.tile_value, value.size()), value.begin());
      tile(origin, nano::kNodeVoxelsLog2[0], is_active, value);
    }
  }

  std::uint64_t childOf(std::uint64_t node, std::int64_t offset) const {
    const std::uint64_t child = node + static_cast<std::uint64_t>(offset);
    if ((offset < 0) != (child < node)) bytes_.fail(fmt::format("a child lies {} bytes from byte {}", offset, node));
    return child;
  }

  // A tree has each node once: one that a broken file has over and over must come to an end.
  void count(std::size_t level, std::size_t node_bytes) {
    if (++visits_[level] * node_bytes > bytes_.size() + node_bytes) {
      bytes_.fail(fmt::format("the tree has more nodes of {} bytes than its {} bytes hold", node_bytes, bytes_.size()));
    }
  }

  template <std::size_t Level, typename Tile, typename Leaf>
  void walkNode(std::uint64_t at, glm::ivec3 origin, const Tile& tile, const Leaf& leaf) {
    if constexpr (Level == 2) {
      leaf(origin, bytes_.get(at, leafBytes(at)));
    } else {
      const nano::NodeLayout& layout = Level == 0 ? layout_.upper : layout_.lower;
      constexpr int kLog2 = nano::kNodeLog2[Level];
      constexpr int kChildLog2 = nano::kNodeVoxelsLog2[Level + 1];
      count(Level, layout.bytes);
      const auto got = bytes_.get(at, layout.bytes);
      const std::vector<std::byte> node(got.begin(), got.end());
      const HeaderBytes fields = numbers(node);
      for (std::size_t n = 0; n < std::size_t{1} << (3 * kLog2); ++n) {
        constexpr std::size_t kMost = (1u << kLog2) - 1;
        const glm::ivec3 cell(n >> (2 * kLog2), n >> kLog2 & kMost, n & kMost);
        const glm::ivec3 place = origin + (cell << kChildLog2);
        const std::size_t entry = layout.table + n * layout.entry;
        if ((fields.u8(layout.child_mask + n / 8) >> (n % 8) & 1) != 0) {
          walkNode<Level + 1>(childOf(at, fields.i64(entry)), place, tile, leaf);
        } else if (const bool is_active = (fields.u8(layout.value_mask + n / 8) >> (n % 8) & 1) != 0;
                   is_active || inside_only_) {
          tile(place, kChildLog2, is_active, std::span<const std::byte>(node).subspan(entry, values_.sizes.bytes));
        }
      }
    }
  }

  std::size_t leafBytes(std::uint64_t at) {
    std::size_t bytes = layout_.leaf_bytes;
    if (type_ == Type::fpn) {
      const int log2_bits = numbers(bytes_.get(at, layout_.leaf_table)).u8(nano::leaf::kFlags) >> 5;
      if (log2_bits > 4) bytes_.fail(fmt::format("a leaf at byte {} has values of {} bits", at, 1 << log2_bits));
      bytes += kLeafVoxels / 8 << log2_bits;
    }
    count(2, layout_.leaf_bytes);
    return bytes;
  }

  float number(std::span<const std::byte> value) const {
    float number = 0;
    std::memcpy(&number, value.data(), sizeof number);
    return number;
  }
  double real(std::span<const std::byte> value) const {
    if (type_ != Type::f64) return static_cast<double>(number(value));
    double number = 0;
    std::memcpy(&number, value.data(), sizeof number);
    return number;
  }
  bool isOn(bool is_active, std::span<const std::byte> value) const {
    return inside_only_ ? real(value) < 0 : is_active;
  }

  // Voxel `n` of a leaf, as a voxel of the format.
  void leafValue(std::span<const std::byte> leaf, std::size_t n, std::span<std::byte> out) const {
    const HeaderBytes fields = numbers(leaf);
    const auto bitOf = [&](std::size_t at) { return static_cast<std::byte>(fields.u8(at + n / 8) >> (n % 8) & 1); };
    const auto code = [&](int log2_bits) -> std::uint32_t {
      if (log2_bits == 4) return fields.u16(layout_.leaf_table + 2 * n);
      const std::size_t bit = n << log2_bits;
      return fields.u8(layout_.leaf_table + bit / 8) >> (bit % 8) & ((1u << (1u << log2_bits)) - 1);
    };
    const auto unpack = [&](int log2_bits) {
      const float value = static_cast<float>(code(log2_bits)) * fields.f32(nano::leaf::kQuantumLeast + 4) +
                          fields.f32(nano::leaf::kQuantumLeast);
      std::memcpy(out.data(), &value, sizeof value);
    };
    switch (type_) {
      case Type::mask:
        out[0] = bitOf(nano::leaf::kMask);
        return;
      case Type::boolean:
        out[0] = bitOf(nano::leaf::kBitTable);
        return;
      case Type::fp4:
        return unpack(2);
      case Type::fp8:
        return unpack(3);
      case Type::fp16:
        return unpack(4);
      case Type::fpn:
        return unpack(fields.u8(nano::leaf::kFlags) >> 5);
      default:
        std::ranges::copy(leaf.subspan(layout_.leaf_table + n * out.size(), out.size()), out.begin());
    }
  }

  void addLeaf(glm::ivec3 origin, std::span<const std::byte> leaf, SparseGrid& grid) {
    const std::size_t bytes = values_.format.voxelBytes();
    std::array<std::byte, kLeafVoxels * 32> all;  // by the file's numbers
    LeafMask mask{};
    const HeaderBytes fields = numbers(leaf);
    for (std::size_t n = 0; n < kLeafVoxels; ++n) {
      const bool is_active = (fields.u8(nano::leaf::kMask + n / 8) >> (n % 8) & 1) != 0;
      if (!is_active && !inside_only_) continue;
      const auto value = std::span(all).subspan(n * bytes, bytes);
      leafValue(leaf, n, value);
      if (inside_only_) {
        if (!isOn(is_active, value)) continue;
        scaleToFog(value);
      }
      mask[n & 7] |= std::uint64_t{1} << ((n >> 3 & 7) * 8 + (n >> 6));
    }
    std::array<std::byte, kLeafVoxels * 32> active;
    std::size_t filled = 0;
    for (std::size_t z = 0; z < mask.size(); ++z) {
      for (std::uint64_t bits = mask[z]; bits != 0; bits &= bits - 1, filled += bytes) {
        const auto bit = static_cast<std::size_t>(std::countr_zero(bits));
        std::memcpy(&active[filled], &all[((bit & 7) << 6 | (bit >> 3) << 3 | z) * bytes], bytes);
      }
    }
    grid.addLeaf(origin, mask, std::span(active).first(filled));
  }

  // In the type of the values, as OpenVDB has it.
  void scaleToFog(std::span<std::byte> value) const {
    if (type_ == Type::f64) {
      const double scaled = real(value) * (1.0 / least_);
      std::memcpy(value.data(), &scaled, sizeof scaled);
    } else {
      const float scaled = number(value) * (1.0f / static_cast<float>(least_));
      std::memcpy(value.data(), &scaled, sizeof scaled);
    }
  }

  // Tiles inside are 1, voxels of the band less: the scale is the least tile of 8^3, or where none is inside the least
  // voxel.
  void findLeast() {
    double least_tile = HUGE_VAL;
    double least_voxel = HUGE_VAL;
    walk(
        [&](glm::ivec3, int log2_side, bool, std::span<const std::byte> value) {
          if (log2_side == nano::kNodeVoxelsLog2[2]) least_tile = std::min(least_tile, real(value));
        },
        [&](glm::ivec3, std::span<const std::byte> leaf) {
          std::array<std::byte, 8> value;
          for (std::size_t n = 0; n < kLeafVoxels; ++n) {
            leafValue(leaf, n, std::span(value).first(values_.format.voxelBytes()));
            least_voxel = std::min(least_voxel, real(value));
          }
        });
    least_ = least_tile > 0 ? std::min(least_tile, least_voxel) : least_tile;
    const double one = 1;
    const float one_float = 1;
    if (type_ == Type::f64) {
      std::memcpy(one_.data(), &one, sizeof one);
    } else {
      std::memcpy(one_.data(), &one_float, sizeof one_float);
    }
  }

  NanoBytes& bytes_;
  Type type_;
  NanoValues values_;
  nano::Layout layout_;
  bool inside_only_;
  std::uint64_t root_ = 0;
  std::uint32_t tile_count_ = 0;
  std::array<std::uint64_t, 3> visits_{};
  double least_ = -1;
  std::array<std::byte, 8> one_{std::byte{1}};  // in the type of the values
};

Type typeOf(const HeaderBytes& head) { return static_cast<Type>(head.u32(nano::grid::kType)); }

}  // namespace

GridInfo nanoGridInfo(NanoBytes& bytes, const std::string& name) {
  const auto got = bytes.get(0, nano::grid::kBytes + nano::tree::kBytes);
  const HeaderBytes head = numbers(got);
  if (head.text(0, nano::kMagic.size()) != nano::kMagic) bytes.fail("does not begin as a grid does");
  if (const auto major = nano::majorOf(head.u32(nano::grid::kVersion)); major != nano::kMajorVersion) {
    bytes.fail(fmt::format("version: {} is not {}, the one that is read", major, nano::kMajorVersion));
  }
  GridInfo info;
  info.name = name;
  const std::uint32_t type = head.u32(nano::grid::kType);
  const std::uint32_t grid_class = head.u32(nano::grid::kClass);
  info.type = nameOf(type, nano::kTypeNames);
  info.grid_class = grid_class == 0 ? "" : nameOf(grid_class, nano::kClassNames);
  const auto values = valuesOf(static_cast<Type>(type));
  if (values) {
    info.format = values->format;
    const bool is_real = values->format.channels == 1 &&
                         (values->format.type == SampleType::f32 || values->format.type == SampleType::f64);
    info.is_level_set = grid_class == nano::kLevelSetClass && is_real;
  } else {
    info.refusal = "values of this type are not read";
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      info.world_from_index[column][row] =
          head.f64(nano::grid::kMatrix + static_cast<std::size_t>(row * 3 + column) * 8);
    }
    info.world_from_index[3][row] = head.f64(nano::grid::kTranslation + static_cast<std::size_t>(row) * 8);
  }
  info.active_voxels = head.u64(nano::grid::kBytes + nano::tree::kVoxels);
  return info;
}

std::shared_ptr<const SparseGrid> readNanoTree(NanoBytes& bytes, const GridInfo& info, std::uint64_t most_bytes,
                                               const std::string& file) {
  const Type type = typeOf(numbers(bytes.get(0, nano::grid::kBytes)));
  NanoTree tree(bytes, type, info.is_level_set);
  auto grid = std::make_shared<SparseGrid>(info.format, tree.background(), most_bytes, file);
  tree.read(*grid);
  grid->finish();
  return grid;
}

}  // namespace blockwalk
