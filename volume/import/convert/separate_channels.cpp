// SPDX-License-Identifier: Apache-2.0
// Several scalar sources on one grid, each of them a channel.
#include <algorithm>
#include <utility>

#include "volume/error.h"
#include "volume/import/convert/channel.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

class SeparateChannels final : public Source {
 public:
  SeparateChannels(std::vector<std::unique_ptr<Source>> sources, SourceInfo info)
      : sources_(std::move(sources)), info_(std::move(info)) {}

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return sources_[channel]->conversion(0); }

  std::unique_ptr<Source> another() const override {
    std::vector<std::unique_ptr<Source>> others;
    for (const auto& source : sources_) {
      others.push_back(source->another());
      if (!others.back()) return nullptr;
    }
    return std::make_unique<SeparateChannels>(std::move(others), info_);
  }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const std::size_t bytes = static_cast<std::size_t>(count) * channelRowBytes(info_);
    BLOCKWALK_CHECK(out.size(), ==, bytes * sources_.size());
    for (std::size_t i = 0; i < sources_.size(); ++i) sources_[i]->readRows(z, y, count, out.subspan(i * bytes, bytes));
  }

  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override {
    std::vector<VoxelRun> all;
    for (const auto& source : sources_) {
      source->findRuns(box, runs);
      all.insert(all.end(), runs.begin(), runs.end());
    }
    mergeRuns(all);
    runs = std::move(all);
  }

  void readBox(const VoxelBox& box, std::span<std::byte> out) override {
    const std::size_t bytes = out.size() / sources_.size();
    for (std::size_t i = 0; i < sources_.size(); ++i) sources_[i]->readBox(box, out.subspan(i * bytes, bytes));
  }

 private:
  std::vector<std::unique_ptr<Source>> sources_;
  SourceInfo info_;
};

// Programs write the same place with different last digits: no voxel may be off by a thousandth of itself.
bool samePlace(const SourceInfo& a, const SourceInfo& b) {
  const double least_step =
      std::min({glm::length(glm::dvec3(a.world_from_index[0])), glm::length(glm::dvec3(a.world_from_index[1])),
                glm::length(glm::dvec3(a.world_from_index[2]))});
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 sides((corner & 1) != 0, (corner & 2) != 0, (corner & 4) != 0);
    const glm::dvec4 index(sides * glm::dvec3(a.dims), 1.0);
    const glm::dvec3 apart(a.world_from_index * index - b.world_from_index * index);
    if (!(glm::length(apart) <= 1e-3 * least_step)) return false;
  }
  return true;
}

void checkAlike(const SourceInfo& first, const SourceInfo& other) {
  if (other.type == VoxelType::rgba8 || other.channels.size() != 1) {
    failData("{}: channels: each source must hold single values to be one channel", other.name);
  }
  if (other.dims != first.dims || other.type != first.type) {
    failData("{}: channels: {} x {} x {} voxels of {}, but {} has {} x {} x {} of {}", other.name, other.dims.x,
             other.dims.y, other.dims.z, voxelTypeName(other.type), first.name, first.dims.x, first.dims.y,
             first.dims.z, voxelTypeName(first.type));
  }
  if (!samePlace(first, other)) {
    failData("{}: channels: its voxels lie elsewhere in the world than those of {}", other.name, first.name);
  }
}

}  // namespace

std::unique_ptr<Source> openSeparate(const std::vector<std::filesystem::path>& paths, const ImportOptions& options) {
  if (paths.size() < 2 || paths.size() > kMaxChannels) {
    failData("channels: {} sources, must be 2..{} to be a channel each", paths.size(), kMaxChannels);
  }
  ImportOptions one = options;
  one.channels = ChannelRule::automatic;
  one.channel_names.clear();
  one.memory_bytes = options.memory_bytes / paths.size();
  std::vector<std::unique_ptr<Source>> sources;
  for (const auto& path : paths) {
    sources.push_back(openSource({path}, one));
    checkAlike(sources[0]->info(), sources.back()->info());
  }
  SourceInfo info = sources[0]->info();
  std::erase_if(info.facts, [](const auto& fact) { return fact.first == kReadFromKey; });
  info.facts.emplace_back(kReadFromKey, fmt::format("{} sources, a channel each", sources.size()));
  for (std::size_t i = 1; i < sources.size(); ++i) {
    const SourceInfo& other = sources[i]->info();
    info.channels.push_back(other.channels[0]);
    info.random_access = info.random_access && other.random_access;
    info.blank.insert(info.blank.end(), other.blank.begin(), other.blank.end());
  }
  // All or none must say where they are blank.
  if (info.blank.size() != sources.size() * voxelBytes(info.type)) info.blank.clear();
  for (std::size_t i = 0; i < sources.size(); ++i) {
    info.channels[i].name = std::filesystem::path(sources[i]->info().name).stem().string();
  }
  nameChannels(info, options);
  return std::make_unique<SeparateChannels>(std::move(sources), std::move(info));
}

}  // namespace blockwalk
