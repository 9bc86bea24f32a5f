// SPDX-License-Identifier: Apache-2.0
// What tests of voxels that come and go share.
#pragma once

#include <utility>

#include "tests/renderer/stage.h"

namespace blockwalk::test {

inline constexpr std::uint64_t kKib = 1024;

class PagesTest : public OwnRendererTest {
 protected:
  // `page_bytes` for the voxels of a level on the device.
  void start(const std::filesystem::path& file, std::uint64_t page_bytes) {
    DeviceOptions options;
    options.page_bytes = page_bytes;
    OwnRendererTest::start(file, options);
  }

  std::uint64_t bytesOf(std::string_view part) const {
    for (const PartTotal& total : renderer_->parts()) {
      if (total.what == part) return total.bytes;
    }
    return 0;
  }

  // Of a frame that waits for nothing.
  Frame drawAsItIs(const View& view) {
    FrameOrder order = orderOf(view);
    order.as_it_is = true;
    return renderer_->render(*volume_, std::move(order));
  }

  // Pieces of two frames by turns.
  std::pair<Frame, Frame> drawByTurns(const View& first, const View& second) {
    const auto one = renderer_->begin(*volume_, orderOf(first));
    const auto other = renderer_->begin(*volume_, orderOf(second));
    for (bool more_of_one = true, more_of_other = true; more_of_one || more_of_other;) {
      if (more_of_one && !one->waits()) more_of_one = one->advance();
      if (more_of_other && !other->waits()) more_of_other = other->advance();
    }
    return {one->finish(), other->finish()};
  }

  // Of the finest level.
  static View finest(int side) {
    View view;
    view.width = view.height = side;
    view.level = 0;
    return view;
  }
};

// So that a small picture's workgroup of rays does not need most of the volume.
inline const BuildOptions kSmallBlocks{.block_side = 2};

// A solid ball of 200: coarser levels have no holes in it.
class Ball final : public Source {
 public:
  explicit Ball(int side) : side_(side) {
    info_.name = "ball";
    info_.format = "test";
    info_.type = VoxelType::u8;
    info_.dims = glm::ivec3(side);
    info_.random_access = true;
  }
  const SourceInfo& info() const override { return info_; }
  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    for (int row = 0; row < count; ++row) {
      for (int x = 0; x < side_; ++x) {
        const glm::dvec3 place = glm::dvec3(x, y + row, z) + 0.5 - side_ / 2.0;
        out[static_cast<std::size_t>(row * side_ + x)] = std::byte(glm::length(place) < 0.45 * side_ ? 200 : 0);
      }
    }
  }

 private:
  int side_;
  SourceInfo info_;
};

inline std::unique_ptr<Source> ball(int side) { return std::make_unique<Ball>(side); }

}  // namespace blockwalk::test
