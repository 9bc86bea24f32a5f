// SPDX-License-Identifier: Apache-2.0
#include "volume/import/vdb/vdb_library.h"

#ifdef BLOCKWALK_OPENVDB
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointDataGrid.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <type_traits>

#include "volume/error.h"
#include "volume/import/vdb/sparse_grid.h"

namespace blockwalk {
namespace {

constexpr int kLeafLog2 = 3;
constexpr int kLowerLog2 = 7;
constexpr int kUpperLog2 = 12;

template <typename T>
struct ValueKind;
template <>
struct ValueKind<bool> {
  static constexpr SampleFormat format{.type = SampleType::u8, .channels = 1};
};
template <>
struct ValueKind<float> {
  static constexpr SampleFormat format{.type = SampleType::f32, .channels = 1};
};
template <>
struct ValueKind<double> {
  static constexpr SampleFormat format{.type = SampleType::f64, .channels = 1};
};
template <>
struct ValueKind<std::int32_t> {
  static constexpr SampleFormat format{.type = SampleType::i32, .channels = 1};
};
template <>
struct ValueKind<std::int64_t> {
  static constexpr SampleFormat format{.type = SampleType::i64, .channels = 1};
};
// How many points a voxel has.
template <>
struct ValueKind<openvdb::PointDataIndex32> {
  static constexpr SampleFormat format{.type = SampleType::f32, .channels = 1};
};
template <typename T>
struct ValueKind<openvdb::math::Vec3<T>> {
  static constexpr SampleFormat format{.type = ValueKind<T>::format.type, .channels = 3};
};

void writeFormat(const SampleFormat& format, PipeWriter& out) {
  out.number(static_cast<std::uint8_t>(format.type));
  out.number(static_cast<std::int32_t>(format.channels));
}

// The active parts of a tree. Of a level set those are what lies inside, as a fog: values below 0 over the least one,
// as openvdb::tools::sdfToFogVolume() has it. Of points those are the voxels that have some.
template <typename GridT>
class TreeWriter {
 public:
  using Tree = typename GridT::TreeType;
  using Root = typename Tree::RootNodeType;
  using Upper = typename Root::ChildNodeType;
  using Lower = typename Upper::ChildNodeType;
  using Leaf = typename Lower::ChildNodeType;
  using Value = typename GridT::ValueType;
  static constexpr bool kArePoints = std::is_same_v<Value, openvdb::PointDataIndex32>;

  TreeWriter(const GridT& grid, PipeWriter& out)
      : root_(grid.constTree().root()),
        out_(out),
        inside_only_(grid.getGridClass() == openvdb::GRID_LEVEL_SET),
        has_background_(grid.getGridClass() != openvdb::GRID_FOG_VOLUME) {
    if constexpr (!std::is_floating_point_v<Value>) inside_only_ = false;
    if (inside_only_) findLeast();
  }

  void write() {
    out_.number(PipeMessage::item);
    out_.number(VdbPart::grid);
    writeFormat(ValueKind<Value>::format, out_);
    if constexpr (std::is_same_v<Tree, openvdb::MaskTree>) {
      writeValue(false);
    } else {
      writeValue(inside_only_ || !has_background_ ? openvdb::zeroVal<Value>() : root_.background());
    }
    forEachTile(root_, [&](const auto& at) { writeTile(at.getCoord(), kUpperLog2, value(*at)); });
    for (auto upper = root_.cbeginChildOn(); upper; ++upper) {
      forEachTile(*upper, [&](const auto& at) { writeTile(at.getCoord(), kLowerLog2, value(*at)); });
      for (auto lower = upper->cbeginChildOn(); lower; ++lower) {
        forEachTile(*lower, [&](const auto& at) { writeTile(at.getCoord(), kLeafLog2, value(*at)); });
        for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf) writeLeaf(*leaf);
      }
    }
  }

 private:
  template <typename Node, typename Visit>
  void forEachTile(const Node& node, Visit visit) const {
    if (inside_only_) {
      for (auto at = node.cbeginValueAll(); at; ++at) {
        if (isInside(*at)) visit(at);
      }
    } else if (!kArePoints) {
      for (auto at = node.cbeginValueOn(); at; ++at) visit(at);
    }
  }

  bool isInside(const Value& value) const {
    if constexpr (std::is_floating_point_v<Value>) return value < Value(0);
    return false;
  }

  // Tiles inside are 1, voxels of the band less: the scale is the least tile, or where there is none the least voxel.
  void findLeast() {
    if constexpr (std::is_floating_point_v<Value>) {
      Value least_tile = std::numeric_limits<Value>::max();
      Value least_voxel = least_tile;
      for (auto upper = root_.cbeginChildOn(); upper; ++upper) {
        for (auto lower = upper->cbeginChildOn(); lower; ++lower) {
          for (auto at = lower->cbeginValueAll(); at; ++at) least_tile = std::min(least_tile, *at);
          for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf) {
            for (auto at = leaf->cbeginValueAll(); at; ++at) least_voxel = std::min(least_voxel, *at);
          }
        }
      }
      const Value least = least_tile > Value(0) ? std::min(least_tile, least_voxel) : least_tile;
      weight_ = least < Value(0) ? Value(1) / least : Value(0);
    }
  }

  // Of a tile.
  Value value(const Value& value) const { return inside_only_ ? Value(1) : value; }

  void writeValue(const Value& value) {
    if constexpr (std::is_same_v<Value, bool>) {
      out_.number(static_cast<std::uint8_t>(value ? 1 : 0));
    } else if constexpr (kArePoints) {
      out_.number(static_cast<float>(static_cast<std::uint32_t>(value)));
    } else if constexpr (ValueKind<Value>::format.channels == 3) {
      for (int i = 0; i < 3; ++i) out_.number(value[i]);
    } else {
      out_.number(value);
    }
  }

  void writeOrigin(const openvdb::Coord& origin) {
    for (int i = 0; i < 3; ++i) out_.number(static_cast<std::int32_t>(origin[i]));
  }

  void writeTile(const openvdb::Coord& origin, int log2_side, const Value& value) {
    out_.number(PipeMessage::item);
    out_.number(VdbPart::tile);
    writeOrigin(origin);
    out_.number(static_cast<std::int32_t>(log2_side));
    writeValue(value);
  }

  // There z is fastest.
  static openvdb::Index numberOf(std::size_t x, std::size_t y, std::size_t z) {
    return static_cast<openvdb::Index>(x << 6 | y << 3 | z);
  }

  Value leafValue(const Leaf& leaf, openvdb::Index number) const {
    if constexpr (std::is_floating_point_v<Value>) {
      return inside_only_ ? leaf.getValue(number) * weight_ : leaf.getValue(number);
    } else if constexpr (kArePoints) {
      // A voxel has where its points end; they begin where those of the voxel before end.
      const std::uint32_t begin = number == 0 ? 0 : static_cast<std::uint32_t>(leaf.getValue(number - 1));
      const std::uint32_t end = leaf.getValue(number);
      return Value(end - std::min(begin, end));
    } else {
      return leaf.getValue(number);
    }
  }

  void writeLeaf(const Leaf& leaf) {
    LeafMask mask{};
    for (std::size_t i = 0; i < kLeafVoxels; ++i) {
      const auto number = static_cast<openvdb::Index>(i);
      const bool is_on = inside_only_ || kArePoints ? leafValue(leaf, number) > Value(0) : leaf.isValueOn(number);
      if (is_on) mask[i & 7] |= std::uint64_t{1} << ((i >> 3 & 7) * 8 + (i >> 6));
    }
    if (activeVoxels(mask) == 0) return;
    out_.number(PipeMessage::item);
    out_.number(VdbPart::leaf);
    writeOrigin(leaf.origin());
    out_.number(mask);
    for (std::size_t z = 0; z < mask.size(); ++z) {
      for (std::uint64_t bits = mask[z]; bits != 0; bits &= bits - 1) {
        const auto bit = static_cast<std::size_t>(std::countr_zero(bits));
        writeValue(leafValue(leaf, numberOf(bit & 7, bit >> 3, z)));
      }
    }
  }

  const Root& root_;
  PipeWriter& out_;
  bool inside_only_;
  bool has_background_;  // of a fog, what is not active is nothing
  Value weight_{};
};

// visit(grid) with the grid's own type; false where it is none that is read.
template <typename Visit>
bool visitTyped(const openvdb::GridBase& grid, Visit visit) {
  const auto as = [&]<typename GridT>(const GridT* typed) {
    if (typed == nullptr) return false;
    visit(*typed);
    return true;
  };
  const auto is = [&]<typename GridT>() {
    return as(grid.isType<GridT>() ? static_cast<const GridT*>(&grid) : nullptr);
  };
  return is.template operator()<openvdb::FloatGrid>() || is.template operator()<openvdb::DoubleGrid>() ||
         is.template operator()<openvdb::Int32Grid>() || is.template operator()<openvdb::Int64Grid>() ||
         is.template operator()<openvdb::BoolGrid>() || is.template operator()<openvdb::MaskGrid>() ||
         is.template operator()<openvdb::Vec3SGrid>() || is.template operator()<openvdb::Vec3DGrid>() ||
         is.template operator()<openvdb::Vec3IGrid>() || is.template operator()<openvdb::points::PointDataGrid>();
}

// One thread: it was forked from a program that may have had others.
class OneThread {
 public:
  OneThread() : limit_(tbb::global_control::max_allowed_parallelism, 1) { openvdb::initialize(); }

 private:
  tbb::global_control limit_;
};

std::string metaText(const openvdb::MetaMap& metadata, const std::string& key) {
  const auto found = metadata[key];
  return found ? found->str() : "";
}

std::uint64_t metaNumber(const openvdb::GridBase& grid, const char* key) {
  const auto found = grid.getMetadata<openvdb::Int64Metadata>(key);
  return found ? static_cast<std::uint64_t>(std::max<openvdb::Int64>(found->value(), 0)) : 0;
}

// As it is written where grids have one name: both halves, without the mark between them.
std::vector<std::string> gridNames(const openvdb::io::File& file) {
  std::vector<std::string> names;
  for (auto name = file.beginName(); name != file.endName(); ++name) names.push_back(*name);
  return names;
}

void listGrid(openvdb::io::File& file, const std::string& name, const std::string& creator, PipeWriter& out) {
  std::string type = "a type that OpenVDB does not know";
  std::string refusal;
  std::string grid_class;
  SampleFormat format;
  bool is_level_set = false;
  bool has_points = false;
  openvdb::Mat4R place = openvdb::Mat4R::identity();
  std::uint64_t voxels = 0;
  std::uint64_t bytes = 0;
  std::string own_creator;
  try {
    const openvdb::GridBase::Ptr grid = file.readGridMetadata(name);
    type = grid->valueType();
    grid_class =
        grid->getGridClass() == openvdb::GRID_UNKNOWN ? "" : openvdb::GridBase::gridClassToString(grid->getGridClass());
    const bool is_read = visitTyped(*grid, [&]<typename GridT>(const GridT&) {
      format = ValueKind<typename GridT::ValueType>::format;
      is_level_set =
          std::is_floating_point_v<typename GridT::ValueType> && grid->getGridClass() == openvdb::GRID_LEVEL_SET;
      has_points = TreeWriter<GridT>::kArePoints;
    });
    if (!is_read) {
      refusal = "values of this type are not read";
    } else if (!grid->transform().isLinear()) {
      refusal = "its transform is a frustum, where voxels have no one size";
    } else {
      place = grid->transform().baseMap()->getAffineMap()->getMat4();
    }
    voxels = metaNumber(*grid, openvdb::GridBase::META_FILE_VOXEL_COUNT);
    bytes = metaNumber(*grid, openvdb::GridBase::META_FILE_MEM_BYTES);
    own_creator = metaText(*grid, openvdb::GridBase::META_GRID_CREATOR);
  } catch (const openvdb::LookupError& error) {  // a type of grid or of map; all else is a broken file
    refusal = error.what();
  }
  out.number(PipeMessage::item);
  out.text(name);
  out.text(type);
  out.text(refusal);
  out.text(grid_class);
  writeFormat(format, out);
  out.number(static_cast<std::uint8_t>(is_level_set ? 1 : 0));
  out.number(static_cast<std::uint8_t>(has_points ? 1 : 0));
  // Rows there are columns here.
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) out.number(static_cast<double>(place(i, j)));
  }
  out.number(voxels);
  out.number(bytes);
  out.text(own_creator.empty() ? creator : own_creator);
}

}  // namespace

bool hasOpenVdb() { return true; }

void listVdbGrids(const std::string& path, PipeWriter& out) {
  const OneThread one_thread;
  openvdb::io::File file(path);
  file.open(false);
  const std::string creator = metaText(*file.getMetadata(), "creator");
  for (const std::string& name : gridNames(file)) listGrid(file, name, creator, out);
}

void readVdbTrees(const std::string& path, const std::vector<std::size_t>& grids, PipeWriter& out) {
  const OneThread one_thread;
  openvdb::io::File file(path);
  file.open(false);
  const std::vector<std::string> names = gridNames(file);
  for (const std::size_t number : grids) {
    if (number >= names.size()) failData("a grid is missing");
    const openvdb::GridBase::Ptr grid = file.readGrid(names[number]);
    const bool is_read =
        visitTyped(*grid, [&]<typename GridT>(const GridT& typed) { TreeWriter<GridT>(typed, out).write(); });
    if (!is_read) failData("a grid has another type than was said");
  }
}

}  // namespace blockwalk

#else

#include "volume/error.h"

namespace blockwalk {

bool hasOpenVdb() { return false; }

void listVdbGrids(const std::string& path, PipeWriter& /*out*/) { failData("{}: no OpenVDB", path); }

void readVdbTrees(const std::string& path, const std::vector<std::size_t>& /*grids*/, PipeWriter& /*out*/) {
  failData("{}: no OpenVDB", path);
}

}  // namespace blockwalk

#endif
