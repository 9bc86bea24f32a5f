// SPDX-License-Identifier: Apache-2.0
#include "volume/import/grids/kvx.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/geometry.h"
#include "volume/import/grids/vox_source.h"
#include "volume/import/header_bytes.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

constexpr std::size_t kColumns = 28;  // byte at which offsets of columns begin, which they are counted from
constexpr std::size_t kPaletteBytes = 768;
constexpr std::uint64_t kKvxPlacedBytes = 40;  // of a voxel while voxels are sorted
constexpr int kMostKvxSide = 256;

struct KvxHead {
  glm::ivec3 dims{0};
  std::uint64_t bytes = 0;  // behind the first number
  std::uint64_t tables = 0;
};

KvxHead headOf(const HeaderBytes& header) {
  KvxHead head{.bytes = header.u32(0)};
  for (int i = 0; i < 3; ++i) head.dims[i] = header.i32(4 + 4 * static_cast<std::size_t>(i));
  const glm::u64vec3 sides(head.dims);
  head.tables = 4 * (sides.x + 1) + 2 * sides.x * (sides.y + 1);
  return head;
}

class KvxColumns {
 public:
  KvxColumns(const InputFile& file, std::uint64_t memory_bytes)
      : name_(file.name()), most_(memory_bytes / 2 / kKvxPlacedBytes) {
    if (file.bytes() > memory_bytes / 4) {
      failData("{}: has {} bytes, must have at most {}, a sixteenth of --memory", name_, file.bytes(),
               memory_bytes / 4);
    }
    bytes_.resize(file.bytes());
    file.read(0, bytes_);
  }

  VoxScene read() {
    const HeaderBytes all(bytes_, std::endian::little);
    const KvxHead head = headOf(all);
    scene_.dims = head.dims;
    const std::uint64_t end = 4 + head.bytes;
    for (int x = 0; x < head.dims.x; ++x) {
      const std::uint64_t of_x = kColumns + std::uint64_t{all.u32(kColumns + 4 * static_cast<std::size_t>(x))};
      for (int y = 0; y < head.dims.y; ++y) {
        const std::size_t entry =
            kColumns + 4 * static_cast<std::size_t>(head.dims.x + 1) +
            2 * (static_cast<std::size_t>(x) * static_cast<std::size_t>(head.dims.y + 1) + static_cast<std::size_t>(y));
        readColumn({x, y, 0}, of_x + all.u16(entry), of_x + all.u16(entry + 2), end);
      }
    }
    readPalette();
    sort();
    return std::move(scene_);
  }

 private:
  // Slabs: first z, length, which faces are seen, colours.
  void readColumn(glm::ivec3 at, std::uint64_t begin, std::uint64_t end, std::uint64_t most) {
    if (begin > end || end > most) {
      failData("{}: column {},{}: bytes {} to {} are declared, voxels end at {}", name_, at.x, at.y, begin, end, most);
    }
    while (begin < end) {
      constexpr std::uint64_t kSlabHead = 3;
      const auto byte = [&](std::uint64_t place) { return std::to_integer<std::uint8_t>(bytes_[place]); };
      if (end - begin < kSlabHead || byte(begin + 1) > end - begin - kSlabHead) {
        failData("{}: column {},{}: a slab at byte {} does not fit before {}", name_, at.x, at.y, begin, end);
      }
      const int first = byte(begin);
      const int length = byte(begin + 1);
      if (first + length > scene_.dims.z) {
        failData("{}: column {},{}: a slab of {} from {} leaves {}", name_, at.x, at.y, length, first, scene_.dims.z);
      }
      for (int i = 0; i < length; ++i)
        add({at.x, at.y, first + i}, byte(begin + kSlabHead + static_cast<std::uint64_t>(i)));
      begin += kSlabHead + static_cast<std::uint64_t>(length);
    }
  }

  void add(glm::ivec3 voxel, std::uint8_t color) {
    if (voxels_.size() >= most_) {
      failData("{}: has more than {} voxels, as many as --memory has room for", name_, most_);
    }
    const glm::u64vec3 v(voxel);
    const glm::u64vec3 dims(scene_.dims);
    voxels_.emplace_back((v.z * dims.y + v.y) * dims.x + v.x, color);
  }

  // Colours of 0..63.
  void readPalette() {
    const std::size_t first = bytes_.size() - kPaletteBytes;
    for (std::size_t i = 0; i < 256; ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        const int value = std::min(63, std::to_integer<int>(bytes_[first + 3 * i + c]));
        scene_.palette[i][c] = static_cast<std::uint8_t>((value * 255 + 31) / 63);
      }
      scene_.palette[i][3] = 255;
    }
  }

  void sort() {
    std::ranges::sort(voxels_);
    for (const auto& [place, color] : voxels_) {
      if (!scene_.places.empty() && scene_.places.back() == place) continue;
      scene_.places.push_back(place);
      scene_.colors.push_back(color);
    }
  }

  std::string name_;
  std::uint64_t most_;
  std::vector<std::byte> bytes_;
  VoxScene scene_;
  std::vector<std::pair<std::uint64_t, std::uint8_t>> voxels_;
};

}  // namespace

bool startsLikeKvx(std::span<const std::byte> start, std::uint64_t file_bytes) {
  if (start.size() < kColumns + 4) return false;
  const HeaderBytes header(start, std::endian::little);
  const KvxHead head = headOf(header);
  for (int i = 0; i < 3; ++i) {
    if (head.dims[i] < 1 || head.dims[i] > kMostKvxSide) return false;
  }
  // The first column's voxels come right behind the tables.
  const bool fits = head.bytes >= kColumns - 4 + head.tables && file_bytes >= 4 + head.bytes + kPaletteBytes;
  return fits && header.u32(kColumns) == head.tables;
}

std::unique_ptr<Source> openKvx(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  SourceInfo info{.name = file->name(), .format = "kvx"};
  // There z leads down, in pictures y leads up.
  Geometry upright;
  upright.axes = {glm::dvec3{1, 0, 0}, glm::dvec3{0, 0, 1}, glm::dvec3{0, -1, 0}};
  info.world_from_index = worldFromIndex(upright, options.spacing, info.name, "spacing");
  tellSpacing(options.spacing, "", info);
  VoxScene scene = KvxColumns(*file, options.memory_bytes).read();
  scene.notes.emplace_back("the format has voxels of surfaces: what they enclose is empty");
  return makeVoxSource(std::move(scene), std::move(info), options);
}

}  // namespace blockwalk
