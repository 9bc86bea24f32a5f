// SPDX-License-Identifier: Apache-2.0
#include "volume/import/chunked_source.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <utility>

namespace blockwalk {
namespace {

// Voxels of a box that lie in one chunk.
struct ChunkPiece {
  glm::ivec3 cell;
  VoxelBox box;
};

std::vector<ChunkPiece> piecesOf(const ChunkLattice& lattice, const VoxelBox& box) {
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
struct SharedSamples {
  std::shared_ptr<ChunkedSamples> samples;
  std::atomic<unsigned> sources = 0;
};

class ChunkedSource final : public Source {
 public:
  ChunkedSource(std::shared_ptr<SharedSamples> shared, ChannelConverter converter, SourceInfo info)
      : shared_(std::move(shared)),
        chunks_(*shared_->samples),
        converter_(std::move(converter)),
        info_(std::move(info)),
        number_(shared_->sources++) {}

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }
  std::unique_ptr<Source> another() const override {
    return std::make_unique<ChunkedSource>(shared_, converter_.anew(), info_);
  }
  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override { chunks_.findRuns(box, runs); }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    readBox({.begin = {0, y, z}, .end = {info_.dims.x, y + count, z + 1}}, out);
  }

  void readBox(const VoxelBox& box, std::span<std::byte> out) override {
    samples_.resize(box.voxels() * converter_.format().voxelBytes());
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      const std::vector<ChunkPiece> pieces = piecesOf(chunks_.lattice(channel), box);
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
    const std::size_t width = converter_.format().voxelBytes();
    const auto chunk = chunks_.chunk(channel, piece.cell);
    const ChunkLayout layout = chunks_.layout(channel);
    const glm::ivec3 first = piece.cell * chunks_.lattice(channel).cellDims();
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
          fillSamplesWith(chunks_.fill(channel), piece.box.dims().x, out);
        }
      }
    }
  }

  std::shared_ptr<SharedSamples> shared_;
  ChunkedSamples& chunks_;
  ChannelConverter converter_;
  SourceInfo info_;
  unsigned number_;
  std::vector<std::byte> samples_;
};

std::vector<std::byte> blankVoxel(const ChunkedSamples& samples, const ChannelConverter& converter,
                                  const SourceInfo& info) {
  std::vector<std::byte> blank(voxelBytes(info.type) * info.channels.size());
  ChannelConverter own = converter.anew();
  for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
    const auto fill = samples.fill(channel);
    std::vector<std::byte> sample(fill.begin(), fill.end());
    own.convertPlane(channel, sample, 0, blank);
  }
  return blank;
}

}  // namespace

ChunkLayout layoutOf(const std::vector<std::uint64_t>& chunk, const std::vector<std::size_t>& order,
                     const ArrayPart& part, std::size_t channel) {
  std::vector<std::uint64_t> steps(chunk.size());
  std::uint64_t step = 1;
  for (std::size_t i = chunk.size(); i-- > 0;) {
    const std::size_t axis = order[i];
    steps[axis] = step;
    step *= chunk[axis];
  }
  ChunkLayout layout;
  for (std::size_t axis = 0; axis < chunk.size(); ++axis) {
    layout.first += part.index[axis] % chunk[axis] * steps[axis];
  }
  if (part.channel) layout.first += channel % chunk[*part.channel] * steps[*part.channel];
  for (int i = 0; i < 3; ++i) {
    const auto axis = part.space[static_cast<std::size_t>(i)];
    if (axis) layout.step[i] = steps[*axis];
  }
  return layout;
}

std::unique_ptr<Source> makeChunkedSource(std::shared_ptr<ChunkedSamples> samples, ChannelConverter converter,
                                          SourceInfo info) {
  if (samples->knowsBlank()) info.blank = blankVoxel(*samples, converter, info);
  auto shared = std::make_shared<SharedSamples>();
  shared->samples = std::move(samples);
  return std::make_unique<ChunkedSource>(std::move(shared), std::move(converter), std::move(info));
}

}  // namespace blockwalk
