// SPDX-License-Identifier: Apache-2.0
#include "volume/import/grids/vox_source.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "volume/import/convert/channel.h"

namespace blockwalk {
namespace {

constexpr std::int64_t kVoxRowsLookedInto = 256;  // of a box with more it is only said whether there is anything

class VoxSource final : public Source {
 public:
  VoxSource(std::shared_ptr<const VoxScene> scene, ChannelConverter converter, SourceInfo info)
      : scene_(std::move(scene)), converter_(std::move(converter)), info_(std::move(info)) {}

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }
  std::unique_ptr<Source> another() const override {
    return std::make_unique<VoxSource>(scene_, converter_.anew(), info_);
  }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    readBox({.begin = {0, y, z}, .end = {info_.dims.x, y + count, z + 1}}, out);
  }

  void readBox(const VoxelBox& box, std::span<std::byte> out) override {
    samples_.assign(box.voxels() * 4, std::byte{0});
    const glm::ivec3 dims = box.dims();
    std::size_t row = 0;
    for (int z = box.begin.z; z < box.end.z; ++z) {
      for (int y = box.begin.y; y < box.end.y; ++y, row += static_cast<std::size_t>(dims.x)) {
        const std::uint64_t begin = placeOf({box.begin.x, y, z});
        for (auto at = from(begin); at != scene_->places.end() && *at < begin + static_cast<std::uint64_t>(dims.x);
             ++at) {
          const std::uint8_t color = scene_->colors[static_cast<std::size_t>(at - scene_->places.begin())];
          std::memcpy(&samples_[(row + (*at - begin)) * 4], scene_->palette[color].data(), 4);
        }
      }
    }
    converter_.convert(samples_, 0, out);
  }

  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override {
    runs.clear();
    const std::int64_t rows = static_cast<std::int64_t>(box.dims().y) * box.dims().z;
    for (int z = box.begin.z; z < box.end.z; ++z) {
      if (rows > kVoxRowsLookedInto) {
        // All that lies in the slice between the box's first and last place, whatever its x.
        const auto at = from(placeOf({box.begin.x, box.begin.y, z}));
        if (at == scene_->places.end()) return;
        if (*at <= placeOf({box.end.x - 1, box.end.y - 1, z})) return runs.assign({{box.begin.x, box.end.x}});
        continue;
      }
      for (int y = box.begin.y; y < box.end.y; ++y) {
        const std::uint64_t begin = placeOf({box.begin.x, y, z});
        const std::uint64_t end = begin + static_cast<std::uint64_t>(box.dims().x);
        for (auto at = from(begin); at != scene_->places.end() && *at < end; ++at) {
          const int x = box.begin.x + static_cast<int>(*at - begin);
          runs.push_back({x, x + 1});
        }
      }
    }
    mergeRuns(runs);
  }

 private:
  std::uint64_t placeOf(glm::ivec3 voxel) const {
    const glm::u64vec3 v(voxel);
    const glm::u64vec3 dims(info_.dims);
    return (v.z * dims.y + v.y) * dims.x + v.x;
  }
  std::vector<std::uint64_t>::const_iterator from(std::uint64_t place) const {
    return std::ranges::lower_bound(scene_->places, place);
  }

  std::shared_ptr<const VoxScene> scene_;
  ChannelConverter converter_;
  SourceInfo info_;
  std::vector<std::byte> samples_;
};

}  // namespace

std::unique_ptr<Source> makeVoxSource(VoxScene scene, SourceInfo info, const ImportOptions& options) {
  info.dims = scene.dims;
  info.random_access = true;
  info.notes = scene.notes;
  const SampleFormat format{.type = SampleType::u8, .channels = 4};
  const ChannelConverter converter(format, true, options, info.name);
  converter.describe(info, options);
  info.blank.resize(voxelBytes(info.type) * info.channels.size());
  return std::make_unique<VoxSource>(std::make_shared<const VoxScene>(std::move(scene)), converter, std::move(info));
}

}  // namespace blockwalk
