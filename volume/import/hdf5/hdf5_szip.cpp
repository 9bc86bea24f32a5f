// SPDX-License-Identifier: Apache-2.0
#include "volume/import/hdf5/hdf5_filters.h"

#ifdef BLOCKWALK_SZIP
extern "C" {
#include <szlib.h>
}

namespace blockwalk {

bool canUndoSzip() { return true; }

bool undoSzip(std::span<const std::byte> packed, const Hdf5Filter& filter, std::span<std::byte> out) {
  constexpr std::size_t kLengthBytes = 4;
  if (filter.values.size() < 4 || packed.size() < kLengthBytes) return false;
  std::uint64_t length = 0;
  for (std::size_t i = kLengthBytes; i-- > 0;) length = length << 8 | std::to_integer<std::uint64_t>(packed[i]);
  SZ_com_t how{.options_mask = static_cast<int>(filter.values[0]),
               .bits_per_pixel = static_cast<int>(filter.values[2]),
               .pixels_per_block = static_cast<int>(filter.values[1]),
               .pixels_per_scanline = static_cast<int>(filter.values[3])};
  const bool has_bits = (how.bits_per_pixel >= 1 && how.bits_per_pixel <= 32) || how.bits_per_pixel == 64;
  const bool has_blocks =
      how.pixels_per_block >= 2 && how.pixels_per_block <= SZ_MAX_PIXELS_PER_BLOCK && how.pixels_per_block % 2 == 0;
  const bool has_lines = how.pixels_per_scanline >= 1 && how.pixels_per_scanline <= SZ_MAX_PIXELS_PER_SCANLINE;
  if (!has_bits || !has_blocks || !has_lines || length != out.size()) return false;
  std::size_t got = out.size();
  const int result =
      SZ_BufftoBuffDecompress(out.data(), &got, packed.data() + kLengthBytes, packed.size() - kLengthBytes, &how);
  return result == SZ_OK && got == out.size();
}

}  // namespace blockwalk

#else

namespace blockwalk {

bool canUndoSzip() { return false; }

bool undoSzip(std::span<const std::byte> /*packed*/, const Hdf5Filter& /*filter*/, std::span<std::byte> /*out*/) {
  return false;
}

}  // namespace blockwalk

#endif
