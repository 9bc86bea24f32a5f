// SPDX-License-Identifier: Apache-2.0
#include "volume/import/hdf5/hdf5_chunks.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <utility>

#include "volume/error.h"
#include "volume/import/hdf5/hdf5_filters.h"
#include "volume/import/zarr/zarr_codec.h"

namespace blockwalk {
namespace {

std::uint64_t samplesIn(const std::vector<std::uint64_t>& sizes) {
  return std::accumulate(sizes.begin(), sizes.end(), std::uint64_t{1}, std::multiplies<>());
}

std::size_t widthOf(const Hdf5Array& array) { return sampleBytes(array.format->type); }

std::uint64_t chunkBytes(const Hdf5Array& array, const std::vector<std::uint64_t>& chunk) {
  return samplesIn(chunk) * widthOf(array);
}

// Of an array in one run of bytes, whole rows of the last axes, about so many bytes.
std::vector<std::uint64_t> piecesOfRun(const Hdf5Array& array) {
  constexpr std::uint64_t kPieceBytes = std::uint64_t{1} << 20;
  std::vector<std::uint64_t> piece(array.rank(), 1);
  std::uint64_t left = kPieceBytes / widthOf(array);
  for (std::size_t axis = array.rank(); axis-- > 0 && left > 1;) {
    piece[axis] = std::min(array.shape[axis], left);
    if (piece[axis] < array.shape[axis]) break;
    left /= piece[axis];
  }
  return piece;
}

void checkArray(const Hdf5Array& array, const std::string& name) {
  if (!array.format) {
    failData("{}: is of type {}; integers of 8 to 64 bits and IEEE floating point can be read", name, array.type);
  }
  if (array.layout == Hdf5Layout::external) {
    failData("{}: its samples lie in other files, which are not followed; h5repack puts them into one", name);
  }
  if (array.layout == Hdf5Layout::mapped) {
    failData("{}: is a virtual dataset, made of others, which are not followed; name one of those, or make a copy",
             name);
  }
}

// The sizes are the file's: their product need not fit 64 bits.
void checkChunkSize(const Hdf5Array& array, const std::string& name, std::uint64_t most_bytes) {
  if (array.chunk.size() != array.rank()) failData("{}: chunks have {} axes", name, array.chunk.size());
  std::uint64_t left = most_bytes / widthOf(array);
  for (const std::uint64_t size : array.chunk) {
    if (size == 0 || size > left) {
      failData("{}: a chunk of {} has more than {} bytes, a sixteenth of --memory", name, fmt::join(array.chunk, " x "),
               most_bytes);
    }
    left /= size;
  }
}

}  // namespace

std::vector<Hdf5Chunks::Cells> Hdf5Chunks::cellsOf(Hdf5File& file, std::vector<Hdf5Dataset> datasets,
                                                   std::uint64_t memory_bytes) {
  std::vector<Cells> all;
  const std::uint64_t most_chunks = memory_bytes / 8 / (sizeof(Hdf5Place) + sizeof(std::uint64_t)) / datasets.size();
  for (Hdf5Dataset& dataset : datasets) {
    const std::string name = fmt::format("{}: '{}'", file.name(), dataset.path);
    const Hdf5Array& array = dataset.array;
    checkArray(array, name);
    if (array.layout == Hdf5Layout::chunked) {
      checkChunkSize(array, name, memory_bytes / 4);
      checkHdf5Filters(array.filters, name);
    }
    std::vector<std::uint64_t> chunk = array.layout == Hdf5Layout::chunked ? array.chunk : piecesOfRun(array);
    const ChunkLattice lattice(dataset.part, chunk);
    Cells cells{.dataset = std::move(dataset), .chunk = std::move(chunk), .lattice = lattice};
    if (cells.dataset.array.layout == Hdf5Layout::chunked) {
      findChunks(file, cells, most_chunks);
    } else if (cells.dataset.array.layout == Hdf5Layout::compact) {
      cells.is_everywhere = true;
      cells.bytes = file.compactBytes(cells.dataset.path);
      const std::uint64_t bytes = chunkBytes(cells.dataset.array, cells.dataset.array.shape);
      if (cells.bytes.size() != bytes) failData("{}: has {} bytes, must have {}", name, cells.bytes.size(), bytes);
    } else if (cells.dataset.array.offset) {
      cells.is_everywhere = true;
      const std::uint64_t have = file.input()->bytes();
      const std::uint64_t offset = *cells.dataset.array.offset;
      std::uint64_t left = (have - std::min(offset, have)) / widthOf(cells.dataset.array);
      for (const std::uint64_t size : cells.dataset.array.shape) {
        if (size > left) {
          failData("{}: {} from byte {} on are declared, the file has {} bytes", name, cells.dataset.array.described(),
                   offset, have);
        }
        left /= size;
      }
    }
    all.push_back(std::move(cells));
  }
  return all;
}

void Hdf5Chunks::findChunks(Hdf5File& file, Cells& cells, std::uint64_t most) {
  const Hdf5Dataset& dataset = cells.dataset;
  const ArrayPart& part = dataset.part;
  const std::vector<std::uint64_t> first = cells.lattice.numbers(part, 0, glm::ivec3(0));
  std::vector<std::uint64_t> count(first.size(), 1);
  std::uint64_t all = cells.lattice.channelCells();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto size = static_cast<std::uint64_t>(cells.lattice.dims()[static_cast<int>(i)]);
    all = all > most / size ? most + 1 : all * size;
    if (part.space[i]) count[*part.space[i]] = size;
  }
  if (part.channel) count[*part.channel] = cells.lattice.channelCells();
  if (all > most) {
    failData("{}: '{}': has more than {} chunks of {}, whose places fit --memory", file.name(), dataset.path, most,
             fmt::join(cells.chunk, " x "));
  }
  const std::vector<Hdf5Place> places = file.chunks(dataset.path, cells.chunk, first, count);
  for (std::uint64_t i = 0; i < places.size(); ++i) {
    if (!places[i].isThere()) continue;
    std::vector<std::uint64_t> numbers = first;
    std::uint64_t left = i;
    for (std::size_t axis = count.size(); axis-- > 0; left /= count[axis]) numbers[axis] += left % count[axis];
    glm::ivec3 cell{0};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (part.space[axis]) cell[static_cast<int>(axis)] = static_cast<int>(numbers[*part.space[axis]]);
    }
    const std::size_t channel_cell = part.channel ? numbers[*part.channel] : 0;
    cells.present.push_back(cells.lattice.number(channel_cell, cell));
    cells.places.push_back(places[i]);
  }
  // The order of the array's axes need not be that of the lattice's.
  std::vector<std::size_t> order(cells.present.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return cells.present[i]; });
  std::vector<Hdf5Place> sorted;
  for (const std::size_t i : order) sorted.push_back(cells.places[i]);
  cells.places = std::move(sorted);
  std::ranges::sort(cells.present);
}

Hdf5Chunks::Hdf5Chunks(Hdf5File& file, std::vector<Hdf5Dataset> datasets, std::uint64_t memory_bytes)
    : file_(file.input()),
      cells_(cellsOf(file, std::move(datasets), memory_bytes)),
      kept_(memory_bytes / 2),
      unpacking_(
          [&] {
            std::uint64_t most = 1;
            for (const Cells& cells : cells_) {
              most = std::max(most, 3 * mostPackedBytes(chunkBytes(cells.dataset.array, cells.chunk)));
            }
            return most;
          }(),
          memory_bytes / 4) {
  for (const Cells& cells : cells_) {
    const std::uint64_t all = cells.lattice.channelCells() * cellCount(cells.lattice.dims());
    if (!cells.is_everywhere && cells.present.size() < all) knows_blank_ = true;
  }
  // There is one voxel that is blank, so that all channels must be able to say where they are.
  for (const Cells& cells : cells_) knows_blank_ = knows_blank_ && !cells.is_everywhere;
}

bool Hdf5Chunks::isAllFill() const {
  return std::ranges::all_of(cells_, [](const Cells& cells) { return !cells.is_everywhere && cells.present.empty(); });
}

ChunkLayout Hdf5Chunks::layout(std::size_t channel) const {
  const Cells& cells = at(channel);
  std::vector<std::size_t> order(cells.chunk.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  return layoutOf(cells.chunk, order, cells.dataset.part, cells_.size() > 1 ? 0 : channel);
}

std::size_t Hdf5Chunks::channelCell(std::size_t channel) const {
  return cells_.size() > 1 ? 0 : at(channel).lattice.channelCell(channel);
}

KeptBytes::Bytes Hdf5Chunks::chunk(std::size_t channel, glm::ivec3 cell) {
  const Cells& cells = at(channel);
  const std::size_t channel_cell = channelCell(channel);
  const std::uint64_t number = cells.lattice.number(channel_cell, cell);
  const std::uint64_t key = number * cells_.size() + (cells_.size() > 1 ? channel : 0);
  if (!cells.is_everywhere) {
    const auto found = std::ranges::lower_bound(cells.present, number);
    if (found == cells.present.end() || *found != number) return nullptr;
    const Hdf5Place& place = cells.places[static_cast<std::size_t>(found - cells.present.begin())];
    return kept_.get(
        key, [&] { return unpack(cells, place, cells.lattice.numbers(cells.dataset.part, channel_cell, cell)); });
  }
  return kept_.get(key, [&] { return readRun(cells, cells.lattice.numbers(cells.dataset.part, channel_cell, cell)); });
}

KeptBytes::Bytes Hdf5Chunks::readRun(const Cells& cells, const std::vector<std::uint64_t>& numbers) {
  const Hdf5Array& array = cells.dataset.array;
  std::uint64_t first = 0;
  std::uint64_t samples = 1;
  for (std::size_t axis = 0; axis < array.rank(); ++axis) {
    const std::uint64_t begin = numbers[axis] * cells.chunk[axis];
    first = first * array.shape[axis] + begin;
    samples *= std::min(cells.chunk[axis], array.shape[axis] - begin);
  }
  const std::size_t width = widthOf(array);
  auto bytes = std::make_shared<std::vector<std::byte>>(chunkBytes(array, cells.chunk));
  const auto out = std::span(*bytes).first(samples * width);
  if (array.layout == Hdf5Layout::compact) {
    std::ranges::copy(std::span(cells.bytes).subspan(first * width, out.size()), out.begin());
  } else {
    file_->read(*array.offset + first * width, out);
  }
  return bytes;
}

KeptBytes::Bytes Hdf5Chunks::unpack(const Cells& cells, const Hdf5Place& place,
                                    const std::vector<std::uint64_t>& numbers) {
  const Hdf5Array& array = cells.dataset.array;
  const std::string name =
      fmt::format("{}: '{}': chunk {}", file_->name(), cells.dataset.path, fmt::join(numbers, ","));
  const std::uint64_t bytes = chunkBytes(array, cells.chunk);
  if (place.bytes > mostPackedBytes(bytes)) {
    failData("{}: has {} bytes, a chunk has {} and when packed at most {}", name, place.bytes, bytes,
             mostPackedBytes(bytes));
  }
  if (place.offset > file_->bytes() || place.bytes > file_->bytes() - place.offset) {
    failData("{}: {} bytes from byte {} are declared, the file has {}", name, place.bytes, place.offset,
             file_->bytes());
  }
  bool is_inside = true;
  for (std::size_t axis = 0; axis < array.rank(); ++axis) {
    is_inside = is_inside && (numbers[axis] + 1) * cells.chunk[axis] <= array.shape[axis];
  }
  const UnpackingRoom::Taken room(unpacking_);
  std::vector<std::byte> packed(place.bytes);
  file_->read(place.offset, packed);
  const bool went_as_it_was = !is_inside && !array.packs_edges;
  return std::make_shared<const std::vector<std::byte>>(unpackHdf5(std::move(packed), array.filters,
                                                                   went_as_it_was ? UINT64_MAX : place.left_out, bytes,
                                                                   sampleBytes(array.format->type), name));
}

void Hdf5Chunks::findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) {
  runs.clear();
  for (const Cells& cells : cells_) {
    const VoxelBox touched = cells.lattice.cellsOf(box);
    for (std::size_t channel = 0; channel < cells.lattice.channelCells(); ++channel) {
      if (!anyCell(cells.present, cells.lattice, channel, touched)) continue;
      addRuns(
          cells.lattice, box,
          [&](glm::ivec3 cell) {
            return std::ranges::binary_search(cells.present, cells.lattice.number(channel, cell));
          },
          runs);
    }
  }
  mergeRuns(runs);
}

}  // namespace blockwalk
