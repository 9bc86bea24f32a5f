// SPDX-License-Identifier: Apache-2.0
// OME-Zarr and plain Zarr arrays, of version 2 and 3.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/convert/channel.h"
#include "volume/import/convert/color_source.h"
#include "volume/import/geometry.h"
#include "volume/import/openers.h"
#include "volume/import/zarr/ome_image.h"
#include "volume/import/zarr/zarr_chunks.h"
#include "volume/import/zarr/zarr_store.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

// Voxels of a box that lie in one chunk.
struct ChunkPiece {
  glm::ivec3 cell;
  VoxelBox box;
};

std::vector<ChunkPiece> piecesOf(const ZarrLattice& lattice, const VoxelBox& box) {
  const VoxelBox cells = lattice.cellsOf(box);
  std::vector<ChunkPiece> pieces;
  for (glm::ivec3 cell = cells.begin; cell.z < cells.end.z; ++cell.z) {
    for (cell.y = cells.begin.y; cell.y < cells.end.y; ++cell.y) {
      for (cell.x = cells.begin.x; cell.x < cells.end.x; ++cell.x) {
        const glm::ivec3 first = cell * lattice.cellDims();
        pieces.push_back({cell,
                          {.begin = glm::max(first, box.begin),
                           .end = glm::min(box.end - lattice.cellDims(), first) + lattice.cellDims()}});
      }
    }
  }
  return pieces;
}

template <std::size_t kWidth>
void copySamples(const std::byte* from, std::size_t step, int count, std::byte* to) {
  if (step == 1) {
    std::memcpy(to, from, static_cast<std::size_t>(count) * kWidth);
    return;
  }
  for (int i = 0; i < count; ++i, from += step * kWidth, to += kWidth) std::memcpy(to, from, kWidth);
}

void copySamples(std::size_t width, const std::byte* from, std::size_t step, int count, std::byte* to) {
  switch (width) {
    case 1:
      return copySamples<1>(from, step, count, to);
    case 2:
      return copySamples<2>(from, step, count, to);
    case 4:
      return copySamples<4>(from, step, count, to);
    default:
      return copySamples<8>(from, step, count, to);
  }
}

void fillSamplesWith(std::span<const std::byte> sample, int count, std::byte* to) {
  for (int i = 0; i < count; ++i, to += sample.size()) std::memcpy(to, sample.data(), sample.size());
}

// What the sources of several threads share.
struct ZarrVolume {
  ZarrVolume(std::shared_ptr<const ZarrStore> store, ZarrArray array, ZarrPart part, std::uint64_t memory_bytes)
      : chunks(std::move(store), std::move(array), std::move(part), memory_bytes) {}

  ZarrChunks chunks;
  std::atomic<unsigned> sources = 0;
};

class ZarrSource final : public Source {
 public:
  ZarrSource(std::shared_ptr<ZarrVolume> volume, ChannelConverter converter, SourceInfo info)
      : volume_(std::move(volume)),
        converter_(std::move(converter)),
        info_(std::move(info)),
        number_(volume_->sources++) {}

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }
  std::unique_ptr<Source> another() const override {
    return std::make_unique<ZarrSource>(volume_, converter_.anew(), info_);
  }
  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override { volume_->chunks.findRuns(box, runs); }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    readBox({.begin = {0, y, z}, .end = {info_.dims.x, y + count, z + 1}}, out);
  }

  void readBox(const VoxelBox& box, std::span<std::byte> out) override {
    const std::vector<ChunkPiece> pieces = piecesOf(volume_->chunks.lattice(), box);
    samples_.resize(box.voxels() * converter_.format().voxelBytes());
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      // Each thread begins elsewhere and every other goes the other way, so that they unpack different chunks.
      double ignored = 0;
      std::size_t at =
          static_cast<std::size_t>(std::modf(number_ * 0.6180339887, &ignored) * static_cast<double>(pieces.size()));
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        readPiece(channel, pieces[at % pieces.size()], box);
        at += number_ % 2 == 0 ? 1 : pieces.size() - 1;
      }
      converter_.convertPlane(channel, samples_, 0, out);
    }
  }

 private:
  void readPiece(std::size_t channel, const ChunkPiece& piece, const VoxelBox& box) {
    const ZarrChunks& chunks = volume_->chunks;
    const std::size_t width = converter_.format().voxelBytes();
    const auto chunk = volume_->chunks.chunk(channel, piece.cell);
    const ChunkLayout layout = chunks.layout(channel);
    const glm::ivec3 first = piece.cell * chunks.lattice().cellDims();
    const glm::ivec3 dims = box.dims();
    for (int z = piece.box.begin.z; z < piece.box.end.z; ++z) {
      for (int y = piece.box.begin.y; y < piece.box.end.y; ++y) {
        const glm::u64vec3 to(piece.box.begin.x - box.begin.x, y - box.begin.y, z - box.begin.z);
        std::byte* out =
            &samples_[((to.z * static_cast<std::uint64_t>(dims.y) + to.y) * static_cast<std::uint64_t>(dims.x) + to.x) *
                      width];
        if (chunk) {
          const glm::u64vec3 in_chunk(glm::ivec3(piece.box.begin.x, y, z) - first);
          const std::uint64_t from =
              layout.first + in_chunk.x * layout.step.x + in_chunk.y * layout.step.y + in_chunk.z * layout.step.z;
          copySamples(width, chunk->data() + from * width, layout.step.x, piece.box.dims().x, out);
        } else {
          fillSamplesWith(chunks.array().fill, piece.box.dims().x, out);
        }
      }
    }
  }

  std::shared_ptr<ZarrVolume> volume_;
  ChannelConverter converter_;
  SourceInfo info_;
  unsigned number_;
  std::vector<std::byte> samples_;
};

// What plain arrays say of their axes, or what is usual.
std::vector<OmeAxis> plainAxes(const ZarrArray& array, std::vector<std::string>& notes) {
  const bool has_x =
      std::ranges::any_of(array.axis_names, [](const std::string& name) { return name == "x" || name == "X"; });
  std::vector<OmeAxis> axes(array.rank());
  if (has_x) {
    for (std::size_t i = 0; i < axes.size(); ++i) axes[i].name = array.axis_names[i];
    return axes;
  }
  constexpr std::string_view kUsual = "tczyx";
  std::string order;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const std::size_t from_end = axes.size() - i;
    axes[i].name =
        from_end <= kUsual.size() ? std::string(1, kUsual[kUsual.size() - from_end]) : fmt::format("axis {}", i);
    if (i > 0) order += ", ";
    order += axes[i].name;
  }
  notes.push_back(fmt::format("the axes are not named: they are taken for {}", order));
  return axes;
}

// Dims, channels and the place on the axes that a volume has not.
ZarrPart choosePart(const ZarrArray& array, const std::vector<OmeAxis>& axes, const ImportOptions& options,
                    std::vector<std::string>& notes) {
  const OmeRoles roles = rolesOf(axes, array.file);
  ZarrPart part = roles.part;
  std::array<std::int64_t, 3> dims{1, 1, 1};
  for (std::size_t i = 0; i < 3; ++i) {
    if (part.space[i]) dims[i] = static_cast<std::int64_t>(array.shape[*part.space[i]]);
  }
  part.dims = checkedDims(dims[0], dims[1], dims[2], array.file, "shape");
  if (part.channel) {
    const std::uint64_t channels = array.shape[*part.channel];
    part.channels = std::min<std::uint64_t>(channels, kMaxChannels);
    if (channels > part.channels)
      notes.push_back(fmt::format("of {} channels it has the first {}", channels, part.channels));
  }
  const std::uint64_t steps = roles.time ? array.shape[*roles.time] : 1;
  const auto step = static_cast<std::uint64_t>(options.time.value_or(0));
  if (step >= steps) failData("{}: time {} is asked for, must be 0..{}", array.file, step, steps - 1);
  if (roles.time) part.index[*roles.time] = step;
  if (steps > 1) notes.push_back(fmt::format("of the {} steps in time it is number {}; --time chooses", steps, step));
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    const bool is_used = part.channel == axis || roles.time == axis ||
                         std::ranges::find(part.space, std::optional(axis)) != part.space.end();
    if (!is_used && array.shape[axis] > 1) {
      notes.push_back(fmt::format("of axis '{}' with {} places it is the first", axes[axis].name, array.shape[axis]));
    }
  }
  return part;
}

std::vector<std::byte> blankVoxel(const ZarrArray& array, const ChannelConverter& converter, const SourceInfo& info) {
  std::vector<std::byte> blank(voxelBytes(info.type) * info.channels.size());
  ChannelConverter own = converter.anew();
  for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
    std::vector<std::byte> fill = array.fill;
    own.convertPlane(channel, fill, 0, blank);
  }
  return blank;
}

// Channel after channel.
std::unique_ptr<Source> openChannels(std::shared_ptr<const ZarrStore> store, const ImportOptions& options) {
  OmeImage image = findOmeImage(*store, "", options.level);
  const auto node = readZarrNode(*store, image.key);
  if (!node || !node->is_array) failData("{}: '{}' is no array", store->name(), image.key);
  ZarrArray array = readZarrArray(*node, options.memory_bytes / 4);
  std::vector<OmeAxis> axes = image.axes;
  if (axes.empty()) axes = plainAxes(array, image.notes);
  if (axes.size() != array.rank()) {
    failData("{}: shape has {} axes, the image's metadata say {}", array.file, array.rank(), axes.size());
  }
  ZarrPart part = choosePart(array, axes, options, image.notes);
  const OmePlace place =
      placeOf(image.world_from_index.value_or(OmeMap::identity(axes.size())), axes, part, image.file);
  SourceInfo info{.name = store->name(), .format = "zarr", .dims = part.dims, .random_access = true};
  info.world_from_index = worldFromIndex(place.geometry, options.spacing, image.file, "coordinateTransformations");
  info.length_unit = place.length_unit;
  info.space = place.space;
  const auto converter = ChannelConverter::ofPlanes(array.format, part.channels, options, info.name);
  converter.describe(info, options);
  const std::vector<std::string> told = describeOmeChannels(image, info.channels);
  image.notes.insert(image.notes.end(), told.begin(), told.end());
  nameChannels(info, options);
  auto volume = std::make_shared<ZarrVolume>(std::move(store), std::move(array), std::move(part), options.memory_bytes);
  if (volume->chunks.knowsBlank()) info.blank = blankVoxel(volume->chunks.array(), converter, info);
  if (volume->chunks.isAllFill()) {
    image.notes.push_back(fmt::format("none of the chunks of '{}' is there: all of it is the fill value{}",
                                      image.key.empty() ? info.name : image.key,
                                      image.levels > 1 ? "; --level chooses another" : ""));
  }
  info.notes = std::move(image.notes);
  return std::make_unique<ZarrSource>(std::move(volume), converter, std::move(info));
}

std::unique_ptr<Source> openStore(std::shared_ptr<const ZarrStore> store, const ImportOptions& options) {
  if (options.channels != ChannelRule::color) return openChannels(std::move(store), options);
  ImportOptions of_channels = options;
  of_channels.channels = ChannelRule::fields;
  of_channels.density = DensityRule::automatic;  // that of the colour
  of_channels.channel_names.clear();
  return makeColorSource(openChannels(std::move(store), of_channels), options);
}

// A level that is named by its own folder has its place from the image around it.
std::unique_ptr<Source> openZarrAt(const std::filesystem::path& path, const ImportOptions& options) {
  constexpr int kMostFoldersUp = 3;
  const std::filesystem::path folder = std::filesystem::absolute(path / "").lexically_normal().parent_path();
  std::filesystem::path around = folder.parent_path();
  for (int i = 0; i < kMostFoldersUp && !options.level && isZarrFolder(folder); ++i, around = around.parent_path()) {
    if (!isZarrFolder(around)) continue;
    auto image = openZarrFolder(around);
    if (const auto level = omeLevelAt(*image, folder.lexically_relative(around).generic_string())) {
      ImportOptions of_level = options;
      of_level.level = level;
      return openStore(std::move(image), of_level);
    }
  }
  return openStore(openZarrFolder(folder), options);
}

}  // namespace

bool isZarrFolder(const std::filesystem::path& folder) {
  return std::ranges::any_of(std::array{"zarr.json", ".zarray", ".zgroup", ".zattrs"}, [&](const char* name) {
    std::error_code absent;
    return std::filesystem::is_regular_file(folder / name, absent);
  });
}

std::unique_ptr<Source> openZarr(const std::filesystem::path& path, const ImportOptions& options) {
  std::error_code absent;
  if (std::filesystem::is_directory(path, absent)) return openZarrAt(path, options);
  return openStore(openZarrZip(path, options.memory_bytes / 4), options);
}

}  // namespace blockwalk
