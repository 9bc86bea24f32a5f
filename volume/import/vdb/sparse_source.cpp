// SPDX-License-Identifier: Apache-2.0
#include "volume/import/vdb/sparse_source.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "volume/error.h"
#include "volume/import/convert/channel.h"
#include "volume/import/geometry.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

template <typename T>
std::byte colorStep(const std::byte* sample, const SparsePlane& plane) {
  T value;
  std::memcpy(&value, sample, sizeof value);
  const double scaled = static_cast<double>(value) * plane.scale;
  if (!(scaled > 0)) return std::byte{0};  // NaN too
  const double least = plane.keeps_some ? 1 : 0;
  return static_cast<std::byte>(static_cast<int>(std::clamp(std::floor(scaled + 0.5), least, 255.0)));
}

// As many samples of one plane, from `stride` to `stride` bytes.
void placeSamples(std::span<const std::byte> samples, SampleType type, const SparsePlane& plane, std::byte* to,
                  std::size_t stride) {
  const std::size_t bytes = sampleBytes(type);
  for (std::size_t i = 0; i < samples.size(); i += bytes, to += stride) {
    if (plane.scale == 0) {
      std::memcpy(to, &samples[i], bytes);
    } else {
      *to = type == SampleType::f64 ? colorStep<double>(&samples[i], plane) : colorStep<float>(&samples[i], plane);
    }
  }
}

class SparseSource final : public Source {
 public:
  SparseSource(std::shared_ptr<const SparseParts> parts, glm::ivec3 origin, ChannelConverter converter, SourceInfo info)
      : parts_(std::move(parts)), origin_(origin), converter_(std::move(converter)), info_(std::move(info)) {}

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }
  std::unique_ptr<Source> another() const override {
    return std::make_unique<SparseSource>(parts_, origin_, converter_.anew(), info_);
  }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    readBox({.begin = {0, y, z}, .end = {info_.dims.x, y + count, z + 1}}, out);
  }

  void readBox(const VoxelBox& box, std::span<std::byte> out) override {
    const SampleFormat& format = converter_.format();
    const std::size_t stride = format.voxelBytes();
    const VoxelBox place{.begin = box.begin + origin_, .end = box.end + origin_};
    samples_.resize(box.voxels() * stride);
    for (std::size_t i = 0; i < parts_->planes.size(); ++i) {
      const SparsePlane& plane = parts_->planes[i];
      const SparseGrid& grid = *parts_->grids[plane.grid];
      plane_.resize(box.voxels() * sampleBytes(grid.format().type));
      grid.read(place, plane.component, plane_);
      placeSamples(plane_, grid.format().type, plane, &samples_[i * sampleBytes(format.type)], stride);
    }
    converter_.convert(samples_, 0, out);
  }

  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override {
    runs.clear();
    for (const auto& grid : parts_->grids) {
      grid->findRuns({.begin = box.begin + origin_, .end = box.end + origin_}, runs);
    }
    for (VoxelRun& run : runs) run = {.begin = run.begin - origin_.x, .end = run.end - origin_.x};
    mergeRuns(runs);
  }

 private:
  std::shared_ptr<const SparseParts> parts_;
  glm::ivec3 origin_;
  ChannelConverter converter_;
  SourceInfo info_;
  std::vector<std::byte> plane_;
  std::vector<std::byte> samples_;
};

SampleFormat formatOf(const SparseParts& parts) {
  const SparsePlane& first = parts.planes.front();
  const SampleType type = first.scale > 0 ? SampleType::u8 : parts.grids[first.grid]->format().type;
  return {.type = type, .channels = static_cast<int>(parts.planes.size())};
}

// The one voxel that is there where nothing is active.
std::vector<std::byte> blankVoxel(const SparseParts& parts, const SampleFormat& format, ChannelConverter converter,
                                  const SourceInfo& info) {
  std::vector<std::byte> samples(format.voxelBytes());
  for (std::size_t i = 0; i < parts.planes.size(); ++i) {
    const SparsePlane& plane = parts.planes[i];
    const SparseGrid& grid = *parts.grids[plane.grid];
    const std::size_t bytes = sampleBytes(grid.format().type);
    placeSamples(grid.background().subspan(static_cast<std::size_t>(plane.component) * bytes, bytes),
                 grid.format().type, plane, &samples[i * sampleBytes(format.type)], format.voxelBytes());
  }
  std::vector<std::byte> blank(voxelBytes(info.type) * info.channels.size());
  converter.convert(samples, 0, blank);
  return blank;
}

}  // namespace

std::unique_ptr<Source> makeSparseSource(SparseParts parts, SourceInfo info, const ImportOptions& options) {
  ActiveBox box;
  for (const auto& grid : parts.grids) box.add(grid->box());
  const glm::i64vec3 dims = box.greatest - box.least + std::int64_t{1};
  info.dims = checkedDims(dims.x, dims.y, dims.z, info.name, "box of active voxels");
  Geometry geometry;
  for (int i = 0; i < 3; ++i) geometry.axes[static_cast<std::size_t>(i)] = glm::dvec3(info.world_from_index[i]);
  geometry.first_center = glm::dvec3(info.world_from_index * glm::dvec4(glm::dvec3(box.least), 1));
  info.world_from_index = worldFromIndex(geometry, options.spacing, info.name, "transform");
  tellSpacing(options.spacing, info.format == "vdb" ? "transform" : "map", info);
  info.random_access = true;
  const SampleFormat format = formatOf(parts);
  const std::vector<SourceChannel> channels = info.channels;
  const ChannelConverter converter(format, parts.is_color, options, info.name);
  ImportOptions unnamed = options;
  unnamed.channel_names.clear();
  converter.describe(info, unnamed);
  for (std::size_t i = 0; channels.size() == info.channels.size() && i < channels.size() && i < kMaxChannels; ++i) {
    if (channels.size() > 1) info.channels[i].name = channels[i].name;
  }
  nameChannels(info, options);
  info.blank = blankVoxel(parts, format, converter.anew(), info);
  return std::make_unique<SparseSource>(std::make_shared<const SparseParts>(std::move(parts)), glm::ivec3(box.least),
                                        converter, std::move(info));
}

}  // namespace blockwalk
