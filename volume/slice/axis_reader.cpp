// SPDX-License-Identifier: Apache-2.0
// A slab of whole voxels: block after block of the picture, and through each of them.
#include <algorithm>
#include <cstring>

#include "volume/slice/slab_sum.h"
#include "volume/slice/slice_reader.h"

namespace blockwalk {
namespace {

class AxisReader : public SliceReader {
 public:
  AxisReader(const VolumeFile& file, SlicePlan plan, std::shared_ptr<const StoredBlocks> blocks)
      : plan_(std::move(plan)),
        type_(file.info().type),
        side_(file.info().blockVoxels()),
        is_single_(plan_.box.dims()[plan_.axis] == 1),
        reader_(file, plan_.level, std::move(blocks), plan_.form) {
    if (type_ == VoxelType::rgba8) {
      pixels_.colors.resize(plan_.pixels());
    } else {
      pixels_.values.assign(plan_.channels.size(), std::vector<float>(plan_.pixels()));
    }
    tile_ = firstTile();
  }

  bool step() override {
    for (int i = 0; i < kBlocksOfStep; ++i) {
      if (channel_ == plan_.channels.size()) return false;
      addBlock();
      advance();
    }
    return channel_ < plan_.channels.size();
  }

  std::uint64_t blocksRead() const override { return blocks_read_; }

 private:
  // In blocks of the level.
  glm::ivec3 firstTile() const { return plan_.box.begin / side_; }
  VoxelBox tileBox() const {
    return {.begin = glm::max(tile_ * side_, plan_.box.begin), .end = glm::min((tile_ + 1) * side_, plan_.box.end)};
  }

  // Through the slab first, so that sums are of one tile.
  void advance() {
    const glm::ivec3 first = firstTile();
    const glm::ivec3 last = (plan_.box.end - 1) / side_;
    for (const int axis : {plan_.axis, plan_.columnAxis(), plan_.rowAxis()}) {
      const bool was_through = axis != plan_.axis;
      if (!was_through && tile_[axis] == last[axis]) finishTile();
      if (tile_[axis] < last[axis]) {
        ++tile_[axis];
        return;
      }
      tile_[axis] = first[axis];
    }
    ++channel_;
  }

  // How much of the slab a layer of the level has, in voxels of level 0.
  double weightOf(int layer) const {
    const std::int64_t begin = std::int64_t{layer} << plan_.level;
    const std::int64_t end = (std::int64_t{layer} + 1) << plan_.level;
    return static_cast<double>(std::min<std::int64_t>(end, plan_.last) - std::max<std::int64_t>(begin, plan_.first));
  }

  void addBlock() {
    const VoxelBox box = tileBox();
    const glm::ivec3 dims = box.dims();
    voxels_.resize(box.voxels() * voxelBytes(type_));
    reader_.read(plan_.channels[channel_], box, voxels_);
    ++blocks_read_;
    if (is_single_) return;
    const auto columns = static_cast<std::size_t>(dims[plan_.columnAxis()]);
    const auto rows = static_cast<std::size_t>(dims[plan_.rowAxis()]);
    const glm::ivec3 strides(1, dims.x, dims.x * dims.y);
    const auto stride = [&](int axis) { return static_cast<std::size_t>(strides[axis]); };
    if (type_ == VoxelType::rgba8) {
      color_sums_.resize(columns * rows);
    } else {
      sums_.resize(columns * rows);
    }
    for (int layer = 0; layer < dims[plan_.axis]; ++layer) {
      const double weight = weightOf(box.begin[plan_.axis] + layer);
      for (std::size_t row = 0; row < rows; ++row) {
        std::size_t voxel = static_cast<std::size_t>(layer) * stride(plan_.axis) + row * stride(plan_.rowAxis());
        for (std::size_t column = 0; column < columns; ++column, voxel += stride(plan_.columnAxis())) {
          addVoxel(row * columns + column, voxels_.data() + voxel * voxelBytes(type_), weight);
        }
      }
    }
  }

  void addVoxel(std::size_t place, const std::byte* voxel, double weight) {
    if (type_ == VoxelType::rgba8) {
      std::uint32_t rgba = 0;
      std::memcpy(&rgba, voxel, sizeof rgba);
      color_sums_[place].add(plan_.reduce, partsOf(rgba), weight);
    } else {
      sums_[place].add(plan_.reduce, static_cast<double>(storedDensity(type_, voxel)), weight);
    }
  }

  void finishTile() {
    const VoxelBox box = tileBox();
    const int column_axis = plan_.columnAxis();
    const int row_axis = plan_.rowAxis();
    const auto columns = static_cast<std::size_t>(box.dims()[column_axis]);
    const auto rows = static_cast<std::size_t>(box.dims()[row_axis]);
    const auto left = static_cast<std::size_t>(box.begin[column_axis] - plan_.box.begin[column_axis]);
    const auto top = static_cast<std::size_t>(box.begin[row_axis] - plan_.box.begin[row_axis]);
    const auto strides = glm::ivec3(1, box.dims().x, box.dims().x * box.dims().y);
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t column = 0; column < columns; ++column) {
        const std::size_t pixel = (top + row) * static_cast<std::size_t>(plan_.width) + left + column;
        // A sum would lose what is stored in voxels that are not finite, and of colours without opacity.
        const std::byte* single = voxels_.data() + (row * static_cast<std::size_t>(strides[row_axis]) +
                                                    column * static_cast<std::size_t>(strides[column_axis])) *
                                                       voxelBytes(type_);
        if (type_ == VoxelType::rgba8) {
          std::uint32_t rgba = 0;
          if (is_single_) std::memcpy(&rgba, single, sizeof rgba);
          pixels_.colors[pixel] = is_single_ ? rgba : color_sums_[row * columns + column].result(plan_.reduce);
        } else {
          pixels_.values[channel_][pixel] =
              is_single_ ? storedDensity(type_, single) : sums_[row * columns + column].result(plan_.reduce);
        }
      }
    }
    sums_.clear();
    color_sums_.clear();
  }

  const SlicePlan plan_;
  const VoxelType type_;
  const int side_;        // of a block
  const bool is_single_;  // the slab is one voxel of the level deep
  BoxReader reader_;
  std::uint64_t blocks_read_ = 0;
  std::size_t channel_ = 0;  // of the plan
  glm::ivec3 tile_{0};
  std::vector<std::byte> voxels_;
  std::vector<ScalarSum> sums_;
  std::vector<ColorSum> color_sums_;
};

}  // namespace

std::unique_ptr<SliceReader> makeAxisReader(const VolumeFile& file, const SlicePlan& plan,
                                            std::shared_ptr<const StoredBlocks> blocks) {
  return std::make_unique<AxisReader>(file, plan, std::move(blocks));
}

std::unique_ptr<SliceReader> makeSliceReader(const VolumeFile& file, const SlicePlan& plan,
                                             std::shared_ptr<const StoredBlocks> blocks) {
  return plan.axis < 0 ? makePlaneReader(file, plan, std::move(blocks)) : makeAxisReader(file, plan, std::move(blocks));
}

}  // namespace blockwalk
