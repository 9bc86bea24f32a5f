// SPDX-License-Identifier: Apache-2.0
// A NanoVDB file: one segment, a grid a channel. The size of a tree must be known before it is written, so each channel
// is read twice: to count its leaves, and to write them.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "volume/build/storage.h"
#include "volume/error.h"
#include "volume/export/export_job.h"
#include "volume/export/nano_leaves.h"
#include "volume/formats/nano_layout.h"

namespace blockwalk {
namespace {

static_assert(std::endian::native == std::endian::little, "fields are written as they lie in memory");

constexpr std::uint32_t kVersion = nano::versionWord(3, 3);
constexpr nano::Layout kLayout = nano::layoutOf({.bytes = 4, .align = 4, .mean_bytes = 4}, 2048);

// Fields of a struct at their places; what is not put is zero.
class Fields {
 public:
  explicit Fields(std::size_t bytes) : bytes_(bytes) {}

  template <typename T>
  void put(std::size_t at, T value) {
    std::memcpy(&bytes_[at], &value, sizeof value);
  }
  void putBytes(std::size_t at, std::span<const std::byte> value) {
    std::ranges::copy(value, bytes_.begin() + static_cast<std::ptrdiff_t>(at));
  }
  void putVector(std::size_t at, const glm::dvec3& v) {
    for (int i = 0; i < 3; ++i) put(at + static_cast<std::size_t>(i) * 8, v[i]);
  }
  void putVector(std::size_t at, glm::ivec3 v) {
    for (int i = 0; i < 3; ++i) put(at + static_cast<std::size_t>(i) * 4, v[i]);
  }
  std::span<const std::byte> all() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

std::uint64_t nameHash(const std::string& name) {
  std::uint64_t hash = 0;
  for (const char letter : name) hash = hash * 67 + static_cast<unsigned char>(letter) + (hash >> 56);
  return hash;
}

// Of one channel.
class GridWriter {
 public:
  GridWriter(const ExportJob& job, std::size_t channel, std::string name, OutputFile& file)
      : job_(job), name_(std::move(name)), number_(channel), reader_(job, channel), file_(file) {}

  // Leaves those of the nodes that hold something.
  void count(const std::vector<NanoLower>& candidates, const std::function<void()>& step) {
    nodes_.reserve(candidates.size());
    for (const NanoLower& node : candidates) {
      NanoLower counted;
      counted.cell = node.cell;
      counted.first_leaf = leaf_count_;
      reader_.read(node, [&](const NanoLeaf& leaf) {
        const glm::ivec3 cell = (leaf.origin - node.cell * kNanoLowerSide) / kNanoLeafSide;
        const auto entry = static_cast<std::size_t>((cell.x << 8) | (cell.y << 4) | cell.z);
        counted.leaves[entry / 64] |= std::uint64_t{1} << (entry % 64);
        ++counted.leaf_count;
        counted.extent.add(leaf.extent);
      });
      step();
      if (counted.leaf_count == 0) continue;
      leaf_count_ += counted.leaf_count;
      extent_.add(counted.extent);
      if (nodes_.empty() || nanoRootKey(nodes_.back().cell) != nanoRootKey(counted.cell))
        uppers_.push_back(nodes_.size());
      nodes_.push_back(counted);
    }
    uppers_.push_back(nodes_.size());
    if (leaf_count_ > UINT32_MAX) {
      failData("{}: channel {} has {} leaves, NanoVDB counts up to {}; export a box or a coarser level",
               job_.file.path().filename().string(), job_.channels[number_], leaf_count_, UINT32_MAX);
    }
  }

  bool isEmpty() const { return leaf_count_ == 0; }
  std::uint64_t gridBytes() const { return leafAt(leaf_count_); }

  void write(std::uint64_t begin, const std::function<void()>& step) {
    begin_ = begin;
    writeHead();
    writeRoot();
    for (std::size_t i = 0; i < upperCount(); ++i) writeUpper(i);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      writeLower(i);
      step();
    }
  }

  // What the segment says of it.
  Fields record() const {
    Fields fields(nano::record::kBytes + name_.size() + 1);
    fields.put(nano::record::kGridBytes, gridBytes());
    fields.put(nano::record::kFileBytes, gridBytes());
    fields.put(nano::record::kNameHash, nameHash(name_));
    fields.put(nano::record::kVoxels, extent_.voxels);
    fields.put(nano::record::kType, static_cast<std::uint32_t>(type()));
    fields.put(nano::record::kClass, gridClass());
    const WorldBox world = worldBoxOf();
    fields.putVector(nano::record::kWorldBox, world.min);
    fields.putVector(nano::record::kWorldBox + 24, world.max);
    fields.putVector(nano::record::kIndexBox, extent_.least);
    fields.putVector(nano::record::kIndexBox + 12, extent_.greatest);
    fields.putVector(nano::record::kVoxelSize, job_.spacing());
    fields.put(nano::record::kNameBytes, static_cast<std::uint32_t>(name_.size() + 1));
    putCounts(fields, nano::record::kNodeCounts);
    fields.put(nano::record::kNodeCounts + 12, std::uint32_t{1});
    fields.put(nano::record::kCodec, static_cast<std::uint16_t>(nano::Codec::none));
    fields.put(nano::record::kVersion, kVersion);
    fields.putBytes(nano::record::kBytes, std::as_bytes(std::span(name_)));
    return fields;
  }

 private:
  bool isColor() const { return job_.type() == VoxelType::rgba8; }
  nano::Type type() const { return isColor() ? nano::Type::rgba8 : nano::Type::f32; }
  std::uint32_t gridClass() const {
    if (isColor()) return nano::kVoxelsClass;
    // A fog is 0 where there is none.
    const bool is_fog =
        job_.channel(number_).values == ChannelValues::intensity && reader_.background() == std::array<std::byte, 4>{};
    return is_fog ? nano::kFogClass : 0;
  }
  std::size_t upperCount() const { return uppers_.size() - 1; }

  // Places in the grid.
  static constexpr std::uint64_t kRootAt = nano::grid::kBytes + nano::tree::kBytes;
  std::uint64_t upperAt(std::size_t i) const {
    return kRootAt + kLayout.root_bytes + upperCount() * kLayout.tile_bytes + i * kLayout.upper.bytes;
  }
  std::uint64_t lowerAt(std::size_t i) const { return upperAt(upperCount()) + i * kLayout.lower.bytes; }
  std::uint64_t leafAt(std::uint64_t i) const { return lowerAt(nodes_.size()) + i * kLayout.leaf_bytes; }

  void writeAt(std::uint64_t at, const Fields& fields) { file_.write(begin_ + at, fields.all()); }

  // Of voxel centres, at whole numbers.
  glm::dmat4 worldFromCentres() const {
    glm::dmat4 place = job_.world_from_index;
    place[3] += 0.5 * (place[0] + place[1] + place[2]);
    return place;
  }
  WorldBox worldBoxOf() const {
    WorldBox world{.min = glm::dvec3(HUGE_VAL), .max = glm::dvec3(-HUGE_VAL)};
    for (int corner = 0; corner < 8; ++corner) {
      const glm::ivec3 far(corner & 1, corner >> 1 & 1, corner >> 2);
      const glm::dvec3 index = glm::mix(glm::dvec3(extent_.least), glm::dvec3(extent_.greatest) + 1.0, glm::dvec3(far));
      const glm::dvec3 at(worldFromCentres() * glm::dvec4(index, 1));
      world.min = glm::min(world.min, at);
      world.max = glm::max(world.max, at);
    }
    return world;
  }

  void putCounts(Fields& fields, std::size_t at) const {
    fields.put(at, static_cast<std::uint32_t>(leaf_count_));
    fields.put(at + 4, static_cast<std::uint32_t>(nodes_.size()));
    fields.put(at + 8, static_cast<std::uint32_t>(upperCount()));
  }

  void putMap(Fields& fields) const {
    const glm::dmat4 place = worldFromCentres();
    const glm::dmat3 back = glm::inverse(glm::dmat3(place));
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        const auto i = static_cast<std::size_t>(row * 3 + column);
        fields.put(nano::grid::kMatrix + i * 8, place[column][row]);
        fields.put(nano::grid::kInverse + i * 8, back[column][row]);
        fields.put(nano::grid::kMapFloats + i * 4, static_cast<float>(place[column][row]));
        fields.put(nano::grid::kMapFloats + 36 + i * 4, static_cast<float>(back[column][row]));
      }
      fields.put(nano::grid::kMapFloats + 72 + static_cast<std::size_t>(row) * 4, static_cast<float>(place[3][row]));
    }
    fields.put(nano::grid::kMapFloats + 84, 1.0f);
    fields.putVector(nano::grid::kTranslation, glm::dvec3(place[3]));
    fields.put(nano::grid::kTaper, 1.0);
  }

  void writeHead() {
    Fields fields(nano::grid::kBytes + nano::tree::kBytes);
    fields.putBytes(0, std::as_bytes(std::span("NanoVDB0", 8)));
    fields.put(nano::grid::kChecksum, UINT64_MAX);
    fields.put(nano::grid::kVersion, kVersion);
    fields.put(nano::grid::kFlags,
               nano::grid::kBreadthFirst | nano::grid::kHasBox | (isColor() ? 0 : nano::grid::kHasRange));
    fields.put(nano::grid::kCount, std::uint32_t{1});
    fields.put(nano::grid::kGridBytes, gridBytes());
    fields.putBytes(nano::grid::kName, std::as_bytes(std::span(name_)).first(std::min<std::size_t>(name_.size(), 255)));
    putMap(fields);
    const WorldBox world = worldBoxOf();
    fields.putVector(nano::grid::kWorldBox, world.min);
    fields.putVector(nano::grid::kWorldBox + 24, world.max);
    fields.putVector(nano::grid::kVoxelSize, job_.spacing());
    fields.put(nano::grid::kClass, gridClass());
    fields.put(nano::grid::kType, static_cast<std::uint32_t>(type()));
    fields.put(nano::grid::kBlindOffset, gridBytes());
    const std::size_t tree = nano::grid::kBytes;
    const std::uint64_t offsets[] = {leafAt(0), lowerAt(0), upperAt(0), kRootAt};
    for (std::size_t i = 0; i < 4; ++i) fields.put(tree + nano::tree::kNodeOffsets + i * 8, offsets[i] - tree);
    putCounts(fields, tree + nano::tree::kNodeCounts);
    fields.put(tree + nano::tree::kVoxels, extent_.voxels);
    writeAt(0, fields);
  }

  void putRange(Fields& fields, std::size_t at, const NanoExtent& extent) const {
    if (isColor()) return;  // colours have none
    fields.put(at, extent.value_min);
    fields.put(at + 4, extent.value_max);
  }

  void putBox(Fields& fields, const NanoExtent& extent) const {
    fields.putVector(0, extent.least);
    fields.putVector(12, extent.greatest);
  }

  void writeRoot() {
    Fields fields(kLayout.root_bytes + upperCount() * kLayout.tile_bytes);
    putBox(fields, extent_);
    fields.put(nano::root::kTileCount, static_cast<std::uint32_t>(upperCount()));
    fields.put(kLayout.background, reader_.background());
    putRange(fields, kLayout.background + 4, extent_);
    for (std::size_t i = 0; i < upperCount(); ++i) {
      const std::size_t tile = kLayout.root_bytes + i * kLayout.tile_bytes;
      fields.put(tile, nanoRootKey(nodes_[uppers_[i]].cell));
      fields.put(tile + nano::root::kTileChild, upperAt(i) - kRootAt);
    }
    writeAt(kRootAt, fields);
  }

  // Entries that are no children are inactive and have the background.
  Fields nodeOf(const nano::NodeLayout& layout) const {
    Fields fields(layout.bytes);
    for (std::size_t at = layout.table; at < layout.bytes; at += layout.entry) fields.put(at, reader_.background());
    return fields;
  }

  void writeUpper(std::size_t i) {
    Fields fields = nodeOf(kLayout.upper);
    NanoExtent extent;
    std::vector<std::uint64_t> children(512);
    for (std::size_t n = uppers_[i]; n < uppers_[i + 1]; ++n) {
      const std::size_t entry = nanoEntry(nodes_[n].cell);
      children[entry / 64] |= std::uint64_t{1} << (entry % 64);
      fields.put(kLayout.upper.table + entry * kLayout.upper.entry, lowerAt(n) - upperAt(i));
      extent.add(nodes_[n].extent);
    }
    putBox(fields, extent);
    fields.putBytes(kLayout.upper.child_mask, std::as_bytes(std::span(children)));
    putRange(fields, kLayout.upper.range, extent);
    writeAt(upperAt(i), fields);
  }

  void writeLower(std::size_t i) {
    const NanoLower& node = nodes_[i];
    Fields fields = nodeOf(kLayout.lower);
    putBox(fields, node.extent);
    fields.putBytes(kLayout.lower.child_mask, std::as_bytes(std::span(node.leaves)));
    putRange(fields, kLayout.lower.range, node.extent);
    std::uint64_t leaf = node.first_leaf;
    for (std::size_t entry = 0; entry < 4096; ++entry) {
      if ((node.leaves[entry / 64] >> (entry % 64) & 1) == 0) continue;
      fields.put(kLayout.lower.table + entry * kLayout.lower.entry, leafAt(leaf++) - lowerAt(i));
    }
    writeAt(lowerAt(i), fields);
    Fields leaves(node.leaf_count * kLayout.leaf_bytes);
    std::size_t at = 0;
    reader_.read(node, [&](const NanoLeaf& voxels) {
      BLOCKWALK_CHECK(at, <, leaves.all().size());
      putLeaf(leaves, at, voxels);
      at += kLayout.leaf_bytes;
    });
    file_.write(begin_ + leafAt(node.first_leaf), leaves.all());
  }

  void putLeaf(Fields& fields, std::size_t at, const NanoLeaf& leaf) const {
    constexpr std::uint8_t kHasBox = 2;
    fields.putVector(at + nano::leaf::kOrigin, leaf.extent.least);
    const glm::ivec3 sides = leaf.extent.greatest - leaf.extent.least;
    for (int i = 0; i < 3; ++i) {
      fields.put(at + nano::leaf::kSides + static_cast<std::size_t>(i), static_cast<std::uint8_t>(sides[i]));
    }
    fields.put(at + nano::leaf::kFlags, kHasBox);
    fields.put(at + nano::leaf::kMask, leaf.mask);
    putRange(fields, at + kLayout.leaf_range, leaf.extent);
    fields.putBytes(at + kLayout.leaf_table, std::as_bytes(std::span(leaf.values)));
  }

  const ExportJob& job_;
  std::string name_;
  std::size_t number_;
  NanoLeafReader reader_;
  OutputFile& file_;
  std::uint64_t begin_ = 0;
  std::vector<NanoLower> nodes_;
  std::vector<std::size_t> uppers_;  // the first node of each upper one, and behind the last
  std::uint64_t leaf_count_ = 0;
  NanoExtent extent_;
};

// Of one channel "density", of several their own, or their numbers.
std::string gridName(const ExportJob& job, std::size_t channel) {
  const std::string& name = job.channel(channel).name;
  if (name.empty() && job.channels.size() == 1) return job.type() == VoxelType::rgba8 ? "color" : "density";
  return name.empty() ? fmt::format("channel {}", job.channels[channel]) : name;
}

// It has places, names and values in data units.
void noteNanoVdbLosses(const ExportJob& job, std::vector<std::string>& notes) {
  const Metadata& metadata = job.file.info().metadata;
  bool has_units = !metadata.length_unit.empty() || !metadata.space.empty();
  bool has_colors = false;
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    const ChannelInfo& channel = job.channel(i);
    has_colors = has_colors || channel.color || channel.window || !channel.labels.empty();
    has_units = has_units || !channel.unit.empty();
    // Whole numbers move up and down exactly.
    if (channel.value_scale == 1 && channel.value_offset == std::floor(channel.value_offset)) continue;
    notes.push_back(fmt::format("values of channel {} are in data units, {} + {} * stored, as 32-bit floats",
                                job.channels[i], channel.value_offset, channel.value_scale));
  }
  if (has_units) notes.emplace_back("units are not kept");
  if (has_colors) notes.emplace_back("colours and windows of channels and names of labels are not kept");
}

}  // namespace

Written writeNanoVdb(const ExportJob& job, const std::filesystem::path& path) {
  OutputFile file(path);
  const std::vector<NanoLower> candidates = nanoCandidates(job);
  std::uint64_t done = 0;
  const auto step = [&] {
    if (job.progress)
      job.progress("write", std::min(++done, 2 * candidates.size() * job.channels.size()),
                   2 * candidates.size() * job.channels.size());
  };
  std::uint64_t head_bytes = nano::segment::kBytes;
  for (std::size_t i = 0; i < job.channels.size(); ++i)
    head_bytes += nano::record::kBytes + gridName(job, i).size() + 1;
  std::uint64_t at = head_bytes;
  Fields head(head_bytes);
  head.putBytes(0, std::as_bytes(std::span("NanoVDB0", 8)));
  head.put(nano::segment::kVersion, kVersion);
  head.put(nano::segment::kGridCount, static_cast<std::uint16_t>(job.channels.size()));
  head.put(nano::segment::kCodec, static_cast<std::uint16_t>(nano::Codec::none));
  std::size_t record_at = nano::segment::kBytes;
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    GridWriter grid(job, i, gridName(job, i), file);
    grid.count(candidates, step);
    if (grid.isEmpty()) {
      failData("{}: channel {}: all of its voxels are empty, and a NanoVDB grid must have some",
               job.file.path().filename().string(), job.channels[i]);
    }
    file.setLength(at + grid.gridBytes());
    grid.write(at, step);
    at += grid.gridBytes();
    const Fields record = grid.record();
    head.putBytes(record_at, record.all());
    record_at += record.all().size();
  }
  file.write(0, head.all());
  file.commit();
  Written written{.bytes = at, .type = job.type() == VoxelType::rgba8 ? "" : "f32", .map = std::nullopt};
  noteNanoVdbLosses(job, written.notes);
  return written;
}

}  // namespace blockwalk
