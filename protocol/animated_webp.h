// SPDX-License-Identifier: Apache-2.0
// Pictures one after the other as one animated WebP.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace blockwalk {

// Keeps what is encoded, and two pictures. Sides are 1..8192. Throws DataError where libwebp refuses.
class AnimatedWebp {
 public:
  // `quality` as of encodeImage(); it loops forever.
  AnimatedWebp(int width, int height, double fps, int quality);
  ~AnimatedWebp();
  AnimatedWebp(const AnimatedWebp&) = delete;
  AnimatedWebp& operator=(const AnimatedWebp&) = delete;

  // Straight rgba8, red in the lowest byte; width * height of them.
  void add(std::span<const std::uint32_t> pixels);
  // The file; nothing can be added any more.
  std::vector<std::byte> finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace blockwalk
