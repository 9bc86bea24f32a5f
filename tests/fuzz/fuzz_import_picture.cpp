// SPDX-License-Identifier: Apache-2.0
// JPEG, JPEG 2000, WebP and GIF files: opened, and read to the end or to a bound.
#include <cstdint>
#include <string>
#include <vector>

#include "tests/fuzz/read_source.h"
#include "tests/fuzz/target.h"
#include "tests/volume/import/slices/picture_writer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  blockwalk::readFile(data, size);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  using namespace blockwalk;
  constexpr std::array<GifColorType, 4> kColors{{{0, 0, 0}, {255, 0, 0}, {0, 200, 0}, {10, 20, 30}}};
  const std::string pixels(256, 'p');
  const std::string indices("\0\1\2\3\0\1", 6);
  std::vector<int> samples(12 * 12);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<int>(i * 37 % 256);
  return {jpegFile(pixels, 8, 8, 3, false),
          jpegFile(pixels, 16, 16, 1, true),
          webpFile(pixels, 9, 6, 4),
          webpAnimation({pixels, std::string(256, 'q')}, 8, 8),
          gifFile(3, 2, kColors,
                  {{0, 0, 3, 2, indices, DISPOSE_DO_NOT},
                   {1, 0, 2, 1, indices.substr(0, 2), DISPOSE_PREVIOUS, 3},
                   {0, 0, 1, 1, indices.substr(1, 1), DISPOSE_BACKGROUND}}),
          gifFile(3, 2, kColors, {{0, 0, 3, 2, indices, 0, -1, true}}),
          jpeg2000File(samples, 12, 12, 1, 8, false),
          jpeg2000File(samples, 6, 8, 3, 12, true, true)};
}
