// SPDX-License-Identifier: Apache-2.0
#include "volume/demo/demo.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "volume/demo/model.h"
#include "volume/error.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

using MakeModel = std::unique_ptr<DemoModel> (*)(int size);

constexpr std::array<std::string_view, 8> kNames = {"fossil", "rock",  "chip",   "vessels",
                                                    "cells",  "smoke", "tissue", "cosmos"};
constexpr std::array<MakeModel, 8> kModels = {makeFossil, makeRock,  makeChip,   makeVessels,
                                              makeCells,  makeSmoke, makeTissue, makeCosmos};

class DemoSource final : public Source {
 public:
  DemoSource(std::string_view name, MakeModel make, int size, std::unique_ptr<DemoModel> model)
      : make_(make), size_(size), model_(std::move(model)), sparse_(model_->sparse()) {
    info_.name = name;
    info_.format = "demo";
    info_.type = model_->type();
    info_.dims = model_->dims();
    info_.random_access = true;
    if (sparse_ != nullptr) info_.blank.resize(voxelBytes(info_.type));
    const std::vector<std::string> channels = model_->channels();
    if (channels.empty()) return;
    info_.channels.resize(channels.size());
    for (std::size_t i = 0; i < channels.size(); ++i) info_.channels[i].name = channels[i];
  }

  const SourceInfo& info() const override { return info_; }
  // A model keeps what it found last, so each has its own.
  std::unique_ptr<Source> another() const override {
    return std::make_unique<DemoSource>(info_.name, make_, size_, sparse_ ? sparse_->another() : make_(size_));
  }

  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override { sparse_->findRuns(box, runs); }
  void readBox(const VoxelBox& box, std::span<std::byte> out) override {
    std::ranges::fill(out, std::byte{0});
    sparse_->writeBox(box, out);
  }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const std::size_t row_bytes = channelRowBytes(info_);
    const std::size_t channels = info_.channels.size();
    const std::size_t plane = row_bytes * static_cast<std::size_t>(count);
    BLOCKWALK_CHECK(out.size(), ==, plane * channels);
    row_.resize(row_bytes * channels);
    for (int i = 0; i < count; ++i) {
      std::ranges::fill(row_, std::byte{0});
      model_->writeRow(y + i, z, row_);
      for (std::size_t channel = 0; channel < channels; ++channel) {
        std::memcpy(&out[channel * plane + static_cast<std::size_t>(i) * row_bytes], &row_[channel * row_bytes],
                    row_bytes);
      }
    }
  }

 private:
  SourceInfo info_;
  MakeModel make_;
  int size_;
  std::unique_ptr<DemoModel> model_;
  SparseModel* sparse_;  // the model, or nothing
  std::vector<std::byte> row_;
};

}  // namespace

std::span<const std::string_view> demoNames() { return kNames; }

std::unique_ptr<Source> openDemo(std::string_view name, int size, std::optional<VoxelType> type) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) {
    std::string known;
    for (const std::string_view one : kNames) known += (known.empty() ? "" : ", ") + std::string(one);
    failData("demo '{}' is not known; there are {}", name, known);
  }
  if (size < 1 || size > kMaxDim) failData("demo {}: size {} is outside 1..{}", name, size, kMaxDim);
  MakeModel make = kModels[static_cast<std::size_t>(found - kNames.begin())];
  if (name == "cosmos" && type == VoxelType::f32) make = makeCosmosOfFloats;
  std::unique_ptr<DemoModel> model = make(size);
  if (type && *type != model->type()) {
    failData("demo {}: it has no type {}; there is {}", name, voxelTypeName(*type),
             name == "cosmos" ? "u16 and f32" : voxelTypeName(model->type()));
  }
  return std::make_unique<DemoSource>(name, make, size, std::move(model));
}

glm::ivec3 demoDims(int size, glm::ivec3 shape) {
  const std::int64_t longest = std::max({shape.x, shape.y, shape.z});
  const auto scaled = [&](int side) {
    return static_cast<int>(std::max<std::int64_t>(1, (std::int64_t{side} * size + longest / 2) / longest));
  };
  return {scaled(shape.x), scaled(shape.y), scaled(shape.z)};
}

}  // namespace blockwalk
