// SPDX-License-Identifier: Apache-2.0
// What tests of voxels that come and go share.
#pragma once

#include <utility>

#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

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

  // That of all voxels, and the paged one. With general kernels: of special ones there would be as many as pictures.
  struct BothFrames {
    Frame expected;
    Frame frame;
  };
  BothFrames drawBoth(Scene& scene, const View& view) {
    FrameOrder order = orderOf(view);
    order.general = true;
    Frame expected = renderer().render(*scene.resident, order);
    return {std::move(expected), renderer_->render(*volume_, std::move(order))};
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
inline std::unique_ptr<Source> ball(int side) {
  return makeVoxels(glm::ivec3(side), [side](glm::ivec3 p) {
    return glm::length(glm::dvec3(p) + 0.5 - side / 2.0) < 0.45 * side ? 200 : 0;
  });
}

}  // namespace blockwalk::test
