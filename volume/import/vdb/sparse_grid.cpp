// SPDX-License-Identifier: Apache-2.0
#include "volume/import/vdb/sparse_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::size_t kGridPieceBytes = std::size_t{1} << 20;
constexpr std::array<int, 3> kTileSides{3, 7, 12};  // log2
constexpr std::int64_t kCellRowsLookedInto = 64;    // of a box with more it is only said whether there is anything

bool comesBeforeCell(glm::ivec3 a, glm::ivec3 b) { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; }

VoxelBox cellsOf(const VoxelBox& box, int log2_side) {
  return {.begin = box.begin >> log2_side, .end = ((box.end - 1) >> log2_side) + 1};
}

// visit(cell) for those of the ascending cells that lie in the box, until it returns false. Goes from each to the next
// that can lie there.
template <typename Cells, typename Visit>
void forEachCell(const Cells& cells, const VoxelBox& box, Visit visit) {
  const auto from = [&](auto begin, glm::ivec3 cell) {
    return std::lower_bound(begin, cells.end(), cell,
                            [](const auto& a, glm::ivec3 b) { return comesBeforeCell(a.cell, b); });
  };
  auto at = from(cells.begin(), box.begin);
  while (at != cells.end() && at->cell.z < box.end.z) {
    glm::ivec3 next = at->cell;
    if (next.x >= box.end.x) next = {box.begin.x, next.y + 1, next.z};
    if (next.y >= box.end.y) next = {box.begin.x, box.begin.y, next.z + 1};
    if (next.y < box.begin.y) next = {box.begin.x, box.begin.y, next.z};
    next.x = std::max(next.x, box.begin.x);
    if (next != at->cell) {
      at = from(at, next);
      continue;
    }
    if (!visit(*at)) return;
    ++at;
  }
}

std::uint32_t rowBits(const LeafMask& mask, int y, int z) {
  return static_cast<std::uint32_t>(mask[static_cast<std::size_t>(z)] >> (8 * y) & 0xff);
}

// Samples of one width from one place to another.
void copySample(std::byte* to, const std::byte* from, std::size_t bytes) {
  switch (bytes) {
    case 1:
      *to = *from;
      return;
    case 2:
      std::memcpy(to, from, 2);
      return;
    case 4:
      std::memcpy(to, from, 4);
      return;
    default:
      std::memcpy(to, from, 8);
  }
}

template <typename T>
void addToRange(const std::byte* sample, std::array<double, 2>& range) {
  T value;
  std::memcpy(&value, sample, sizeof value);
  const auto number = static_cast<double>(value);
  if (!std::isfinite(number)) return;
  range[0] = std::min(range[0], number);
  range[1] = std::max(range[1], number);
}

}  // namespace

std::size_t activeVoxels(const LeafMask& mask) {
  std::size_t count = 0;
  for (const std::uint64_t word : mask) count += static_cast<std::size_t>(std::popcount(word));
  return count;
}

SparseGrid::SparseGrid(const SampleFormat& format, std::span<const std::byte> background, std::uint64_t most_bytes,
                       std::string name)
    : format_(format),
      background_(background.begin(), background.end()),
      most_bytes_(most_bytes),
      name_(std::move(name)) {
  BLOCKWALK_CHECK(background.size(), ==, format.voxelBytes());
}

void SparseGrid::take(std::uint64_t bytes) {
  bytes_ += bytes;
  if (bytes_ > most_bytes_) {
    failData("{}: its active voxels take more than {} bytes of memory, a quarter of --memory", name_, most_bytes_);
  }
}

std::uint64_t SparseGrid::keep(std::span<const std::byte> values) {
  if (pieces_.empty() || kGridPieceBytes - pieces_.back().size() < values.size()) {
    take(kGridPieceBytes);
    pieces_.emplace_back().reserve(kGridPieceBytes);
  }
  std::vector<std::byte>& piece = pieces_.back();
  const std::uint64_t first = (pieces_.size() - 1) * kGridPieceBytes + piece.size();
  piece.insert(piece.end(), values.begin(), values.end());
  return first;
}

const std::byte* SparseGrid::at(std::uint64_t byte) const {
  return pieces_[byte / kGridPieceBytes].data() + byte % kGridPieceBytes;
}

void SparseGrid::addLeaf(glm::ivec3 origin, const LeafMask& mask, std::span<const std::byte> values) {
  const std::size_t count = activeVoxels(mask);
  BLOCKWALK_CHECK(values.size(), ==, count * format_.voxelBytes());
  if (count == 0) return;
  take(2 * sizeof(Leaf));  // a list that grows is there twice
  leaves_.push_back({.cell = origin >> 3, .first = keep(values), .mask = mask});
  voxels_ += count;
  leaf_voxels_ += count;
  std::uint64_t rows = 0;
  ActiveBox box;
  for (int z = 0; z < kLeafSide; ++z) {
    const std::uint64_t word = mask[static_cast<std::size_t>(z)];
    if (word == 0) continue;
    rows |= word;
    box.least.z = std::min<std::int64_t>(box.least.z, z);
    box.greatest.z = z;
  }
  std::uint64_t columns = rows | rows >> 32;
  columns |= columns >> 16;
  columns = (columns | columns >> 8) & 0xff;
  box.least.y = std::countr_zero(rows) / kLeafSide;
  box.greatest.y = (63 - std::countl_zero(rows)) / kLeafSide;
  box.least.x = std::countr_zero(columns);
  box.greatest.x = 63 - std::countl_zero(columns);
  box.least += glm::i64vec3(origin);
  box.greatest += glm::i64vec3(origin);
  box_.add(box);
}

void SparseGrid::addTile(glm::ivec3 origin, int log2_side, std::span<const std::byte> value) {
  BLOCKWALK_CHECK(value.size(), ==, format_.voxelBytes());
  const std::size_t size = log2_side == kTileSides[0] ? 0 : log2_side == kTileSides[1] ? 1 : 2;
  BLOCKWALK_CHECK(log2_side, ==, kTileSides[size]);
  take(2 * sizeof(Tile));
  tiles_[size].push_back({.cell = origin >> log2_side, .first = keep(value)});
  voxels_ += std::uint64_t{1} << (3 * log2_side);
  box_.add({.least = glm::i64vec3(origin), .greatest = glm::i64vec3(origin) + ((std::int64_t{1} << log2_side) - 1)});
}

void SparseGrid::finish() {
  const auto sort = [&](auto& cells) {
    std::ranges::sort(cells, comesBeforeCell, [](const auto& cell) { return cell.cell; });
    const auto twice = std::ranges::adjacent_find(cells, [](const auto& a, const auto& b) { return a.cell == b.cell; });
    if (twice == cells.end()) return;
    failData("{}: the tree has one node twice, cell {},{},{} of its lattice", name_, twice->cell.x, twice->cell.y,
             twice->cell.z);
  };
  if (box_.empty()) failData("{}: no voxel of it is active", name_);
  for (int i = 0; i < 3; ++i) {
    if (box_.least[i] >= -kFarthest && box_.greatest[i] < kFarthest) continue;
    failData("{}: active voxels lie at {}..{} along axis {}, must lie in {}..{}", name_, box_.least[i],
             box_.greatest[i], i, -kFarthest, kFarthest - 1);
  }
  sort(leaves_);
  for (auto& tiles : tiles_) sort(tiles);
}

std::uint64_t SparseGrid::tileCount() const { return tiles_[0].size() + tiles_[1].size() + tiles_[2].size(); }

void SparseGrid::read(const VoxelBox& box, int component, std::span<std::byte> out) const {
  const std::size_t bytes = sampleBytes(format_.type);
  const std::size_t sample = static_cast<std::size_t>(component) * bytes;
  BLOCKWALK_CHECK(out.size(), ==, box.voxels() * bytes);
  for (std::size_t i = 0; i < out.size(); i += bytes) copySample(&out[i], &background_[sample], bytes);
  const glm::i64vec3 dims(box.dims());
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    forEachCell(tiles_[i], cellsOf(box, kTileSides[i]), [&](const Tile& tile) {
      const glm::ivec3 side(1 << kTileSides[i]);
      const glm::ivec3 begin = glm::max(box.begin, tile.cell * side) - box.begin;
      const glm::ivec3 end = glm::min(box.end, tile.cell * side + side) - box.begin;
      for (std::int64_t z = begin.z; z < end.z; ++z) {
        for (std::int64_t y = begin.y; y < end.y; ++y) {
          std::byte* to = &out[static_cast<std::size_t>((z * dims.y + y) * dims.x + begin.x) * bytes];
          for (int x = begin.x; x < end.x; ++x, to += bytes) copySample(to, at(tile.first) + sample, bytes);
        }
      }
      return true;
    });
  }
  forEachCell(leaves_, cellsOf(box, 3), [&](const Leaf& leaf) {
    readLeaf(leaf, box, sample, out);
    return true;
  });
}

void SparseGrid::readLeaf(const Leaf& leaf, const VoxelBox& box, std::size_t sample, std::span<std::byte> out) const {
  const std::size_t bytes = sampleBytes(format_.type);
  const std::size_t stride = format_.voxelBytes();
  const glm::i64vec3 dims(box.dims());
  const glm::ivec3 origin = leaf.cell * kLeafSide;
  const glm::ivec3 begin = glm::max(box.begin, origin) - origin;
  const glm::ivec3 end = glm::min(box.end, origin + kLeafSide) - origin;
  const std::uint32_t columns = ((1u << end.x) - 1) & ~((1u << begin.x) - 1);
  std::size_t before = 0;  // active voxels of the slices in front
  for (int z = 0; z < begin.z; ++z)
    before += static_cast<std::size_t>(std::popcount(leaf.mask[static_cast<std::size_t>(z)]));
  for (int z = begin.z; z < end.z; ++z) {
    const std::uint64_t slice = leaf.mask[static_cast<std::size_t>(z)];
    for (int y = begin.y; y < end.y; ++y) {
      const std::uint32_t row = rowBits(leaf.mask, y, z);
      const std::size_t first =
          before + static_cast<std::size_t>(std::popcount(slice & ((std::uint64_t{1} << (8 * y)) - 1)));
      const std::int64_t to =
          ((origin.z - box.begin.z + z) * dims.y + (origin.y - box.begin.y + y)) * dims.x + (origin.x - box.begin.x);
      for (std::uint32_t bits = row & columns; bits != 0; bits &= bits - 1) {
        const int x = std::countr_zero(bits);
        const auto number = first + static_cast<std::size_t>(std::popcount(row & ((1u << x) - 1)));
        copySample(&out[static_cast<std::size_t>(to + x) * bytes], at(leaf.first) + number * stride + sample, bytes);
      }
    }
    before += static_cast<std::size_t>(std::popcount(slice));
  }
}

void SparseGrid::findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) const {
  const VoxelBox cells = cellsOf(box, 3);
  const bool looks_into = std::int64_t{cells.dims().y} * cells.dims().z <= kCellRowsLookedInto;
  bool found = false;
  const auto add = [&](int begin, int end) {
    found = true;
    runs.push_back({.begin = std::max(begin, box.begin.x), .end = std::min(end, box.end.x)});
  };
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    forEachCell(tiles_[i], cellsOf(box, kTileSides[i]), [&](const Tile& tile) {
      const int begin = tile.cell.x << kTileSides[i];
      add(begin, begin + (1 << kTileSides[i]));
      return looks_into;
    });
  }
  forEachCell(leaves_, cells, [&](const Leaf& leaf) {
    const glm::ivec3 origin = leaf.cell * kLeafSide;
    const glm::ivec3 begin = glm::max(box.begin, origin) - origin;
    const glm::ivec3 end = glm::min(box.end, origin + kLeafSide) - origin;
    std::uint32_t columns = 0;
    for (int z = begin.z; z < end.z; ++z) {
      for (int y = begin.y; y < end.y; ++y) columns |= rowBits(leaf.mask, y, z);
    }
    columns &= ((1u << end.x) - 1) & ~((1u << begin.x) - 1);
    if (columns != 0) add(origin.x + std::countr_zero(columns), origin.x + std::bit_width(columns));
    return looks_into || columns == 0;
  });
  if (found && !looks_into) runs.push_back({.begin = box.begin.x, .end = box.end.x});
}

std::array<double, 2> SparseGrid::range(int first, int last) const {
  std::array<double, 2> range{HUGE_VAL, -HUGE_VAL};
  const std::size_t bytes = sampleBytes(format_.type);
  const auto add = [&](const std::byte* voxel) {
    for (int component = first; component < last; ++component) {
      const std::byte* sample = voxel + static_cast<std::size_t>(component) * bytes;
      if (format_.type == SampleType::f64) {
        addToRange<double>(sample, range);
      } else {
        addToRange<float>(sample, range);
      }
    }
  };
  for (const Leaf& leaf : leaves_) {
    for (std::size_t i = 0; i < activeVoxels(leaf.mask); ++i) add(at(leaf.first) + i * format_.voxelBytes());
  }
  for (const auto& tiles : tiles_) {
    for (const Tile& tile : tiles) add(at(tile.first));
  }
  return range[0] <= range[1] ? range : std::array<double, 2>{0, 0};
}

}  // namespace blockwalk
