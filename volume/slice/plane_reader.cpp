// SPDX-License-Identifier: Apache-2.0
// Any plane, in squares of pixels, one layer of samples through the slab after the other: the blocks of a layer are the
// next one's too, however deep the slab is. Channel after channel, so that all the room is one's.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "volume/slice/held_blocks.h"
#include "volume/slice/slab_sum.h"
#include "volume/slice/slice_reader.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kHeldBytes = std::uint64_t{64} << 20;

class PlaneReader : public SliceReader {
 public:
  PlaneReader(const VolumeFile& file, SlicePlan plan, std::shared_ptr<const StoredBlocks> blocks)
      : file_(file),
        plan_(std::move(plan)),
        info_(file.info()),
        dims_(info_.dims),
        level_dims_(info_.level(plan_.level, plan_.form).dims),
        has_colors_(info_.type == VoxelType::rgba8),
        is_as_stored_(plan_.samples == 1 && !plan_.is_linear),
        reader_(file, plan_.level, std::move(blocks), plan_.form) {
    const glm::dmat4 index_from_world = glm::inverse(info_.world_from_index);
    const auto direction = [&](const glm::dvec3& world) { return glm::dvec3(index_from_world * glm::dvec4(world, 0)); };
    corner_ = glm::dvec3(index_from_world * glm::dvec4(plan_.corner, 1));
    right_ = direction(plan_.right);
    down_ = direction(plan_.down);
    through_ = direction(plan_.through) / static_cast<double>(plan_.samples);
    if (has_colors_) {
      pixels_.colors.resize(plan_.pixels());
    } else {
      pixels_.values.assign(plan_.channels.size(),
                            std::vector<float>(plan_.pixels(), std::numeric_limits<float>::quiet_NaN()));
    }
    beginChannel();
    beginSquare();
  }

  bool step() override {
    const std::uint64_t most_blocks = blocksRead() + kBlocksOfStep;
    int samples = 0;
    while (channel_ < plan_.channels.size() && samples < kSamplesOfStep && blocksRead() < most_blocks) {
      samples += addRow(most_blocks);
    }
    return channel_ < plan_.channels.size();
  }

  std::uint64_t blocksRead() const override { return blocks_before_ + (held_ ? held_->held() : 0); }

 private:
  void beginChannel() {
    blocks_before_ = blocksRead();
    held_.reset();
    if (channel_ == plan_.channels.size()) return;
    const int channel = plan_.channels[channel_];
    held_.emplace(file_, reader_, level_dims_, channel, kHeldBytes);
    const ChannelInfo& look = info_.channels[static_cast<std::size_t>(channel)];
    empty_threshold_ = look.empty_threshold;
    empty_value_ = static_cast<double>(emptyValue(info_.type, look));
  }

  void beginSquare() {
    square_ = glm::min(glm::ivec2(plan_.width, plan_.height) - corner_pixel_, kSliceSquare);
    const auto pixels = static_cast<std::size_t>(square_.x) * static_cast<std::size_t>(square_.y);
    if (has_colors_) {
      color_sums_.assign(pixels, {});
    } else {
      sums_.assign(pixels, {});
    }
  }

  // What is left of a row of the square, in one layer of samples, or as much of it as blocks may be read for. How many
  // samples that were.
  int addRow(std::uint64_t most_blocks) {
    const int begin = at_.x;
    while (at_.x < square_.x && blocksRead() < most_blocks) {
      addSample();
      ++at_.x;
    }
    const int count = at_.x - begin;
    if (at_.x == square_.x) advance();
    return count;
  }

  // Rows, layers, squares, channels.
  void advance() {
    at_.x = 0;
    if (++at_.y < square_.y) return;
    at_.y = 0;
    if (++layer_ < plan_.samples) return;
    layer_ = 0;
    finishSquare();
    corner_pixel_.x += kSliceSquare;
    if (corner_pixel_.x >= plan_.width) corner_pixel_ = {0, corner_pixel_.y + kSliceSquare};
    if (corner_pixel_.y >= plan_.height) {
      corner_pixel_ = {0, 0};
      ++channel_;
      beginChannel();
    }
    beginSquare();
  }

  std::size_t pixelAt(glm::ivec2 place) const {
    return static_cast<std::size_t>(place.y) * static_cast<std::size_t>(plan_.width) +
           static_cast<std::size_t>(place.x);
  }

  void addSample() {
    const glm::ivec2 pixel = corner_pixel_ + at_;
    const glm::dvec3 place =  // in voxels of level 0
        corner_ + (pixel.x + 0.5) * right_ + (pixel.y + 0.5) * down_ + (layer_ + 0.5) * through_;
    if (!isInside(place)) return;
    // A sum would lose what is stored in voxels that are not finite, and of colours without opacity.
    if (is_as_stored_) {
      const std::byte* voxel = held_->voxel(voxelAt(place));
      if (has_colors_) {
        std::memcpy(&pixels_.colors[pixelAt(pixel)], voxel, sizeof(std::uint32_t));
      } else {
        pixels_.values[channel_][pixelAt(pixel)] = storedDensity(info_.type, voxel);
      }
      return;
    }
    const auto sum =
        static_cast<std::size_t>(at_.y) * static_cast<std::size_t>(square_.x) + static_cast<std::size_t>(at_.x);
    if (has_colors_) {
      color_sums_[sum].add(plan_.reduce, colorAt(place), 1);
    } else {
      sums_[sum].add(plan_.reduce, valueAt(place), 1);
    }
  }

  void finishSquare() {
    if (is_as_stored_) return;
    for (int row = 0; row < square_.y; ++row) {
      for (int column = 0; column < square_.x; ++column) {
        const std::size_t pixel = pixelAt(corner_pixel_ + glm::ivec2(column, row));
        const auto sum =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(square_.x) + static_cast<std::size_t>(column);
        if (has_colors_) {
          pixels_.colors[pixel] = color_sums_[sum].result(plan_.reduce);
        } else {
          pixels_.values[channel_][pixel] = sums_[sum].result(plan_.reduce);
        }
      }
    }
  }

  bool isInside(const glm::dvec3& place) const {
    return glm::all(glm::greaterThanEqual(place, glm::dvec3(0))) && glm::all(glm::lessThan(place, glm::dvec3(dims_)));
  }
  glm::dvec3 levelPlace(const glm::dvec3& place) const { return place * std::ldexp(1.0, -plan_.level); }
  glm::ivec3 voxelAt(const glm::dvec3& place) const { return glm::ivec3(glm::floor(levelPlace(place))); }

  double valueAt(const glm::dvec3& place) {
    if (!plan_.is_linear) return static_cast<double>(storedDensity(info_.type, held_->voxel(voxelAt(place))));
    double sum = 0;
    eachNeighbour(place, [&](glm::ivec3 voxel, double weight) {
      const float stored = storedDensity(info_.type, held_->voxel(voxel));
      sum += weight * (isEmptyDensity(stored, empty_threshold_) ? empty_value_ : static_cast<double>(stored));
    });
    return sum;
  }

  std::array<double, 4> colorAt(const glm::dvec3& place) {
    const auto colorOf = [&](glm::ivec3 voxel) {
      std::uint32_t rgba = 0;
      std::memcpy(&rgba, held_->voxel(voxel), sizeof rgba);
      return partsOf(rgba);
    };
    if (!plan_.is_linear) return colorOf(voxelAt(place));
    std::array<double, 4> sum{};
    eachNeighbour(place, [&](glm::ivec3 voxel, double weight) {
      const std::array<double, 4> color = colorOf(voxel);
      for (std::size_t i = 0; i < 3; ++i) sum[i] += weight * color[3] * color[i];
      sum[3] += weight * color[3];
    });
    for (std::size_t i = 0; i < 3; ++i) sum[i] = sum[3] > 0 ? sum[i] / sum[3] : 0;
    return sum;
  }

  // The eight whose centres lie around it, and how much each counts; outside of the level those at its edge.
  template <typename Add>
  void eachNeighbour(const glm::dvec3& place, Add add) const {
    const glm::dvec3 from_centres = levelPlace(place) - 0.5;
    const glm::dvec3 low = glm::floor(from_centres);
    const glm::dvec3 share = from_centres - low;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::ivec3 offset(corner & 1, corner >> 1 & 1, corner >> 2);
      double weight = 1;
      for (int axis = 0; axis < 3; ++axis) weight *= offset[axis] == 1 ? share[axis] : 1 - share[axis];
      if (weight > 0) add(glm::clamp(glm::ivec3(low) + offset, glm::ivec3(0), level_dims_ - 1), weight);
    }
  }

  const VolumeFile& file_;
  const SlicePlan plan_;
  const VolumeInfo& info_;
  const glm::ivec3 dims_;
  const glm::ivec3 level_dims_;
  const bool has_colors_;
  const bool is_as_stored_;  // a pixel is one voxel
  BoxReader reader_;
  // The picture, in voxels of level 0; `through_` is from one sample to the next.
  glm::dvec3 corner_{0};
  glm::dvec3 right_{0};
  glm::dvec3 down_{0};
  glm::dvec3 through_{0};
  // Of the channel under way.
  std::size_t channel_ = 0;  // of the plan
  std::optional<HeldBlocks> held_;
  std::uint64_t blocks_before_ = 0;  // read for channels before it
  float empty_threshold_ = 0;
  double empty_value_ = 0;
  // The square under way, its pixels, and what comes next: a sample's layer, and its pixel of the square.
  glm::ivec2 corner_pixel_{0};
  glm::ivec2 square_{0};
  std::vector<ScalarSum> sums_;
  std::vector<ColorSum> color_sums_;
  int layer_ = 0;
  glm::ivec2 at_{0};
};

}  // namespace

std::unique_ptr<SliceReader> makePlaneReader(const VolumeFile& file, const SlicePlan& plan,
                                             std::shared_ptr<const StoredBlocks> blocks) {
  return std::make_unique<PlaneReader>(file, plan, std::move(blocks));
}

}  // namespace blockwalk
