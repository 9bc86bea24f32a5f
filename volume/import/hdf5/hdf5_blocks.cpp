// SPDX-License-Identifier: Apache-2.0
// Filters that pack a chunk piece by piece: LZ4 as filter 32004 frames it, LZF, and bitshuffle (Masui et al. 2015).
#include <lz4.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>

#include "volume/import/hdf5/hdf5_filters.h"

namespace blockwalk {
namespace {

// Goes through packed bytes; what is asked for beyond their end is not there.
class BlockReader {
 public:
  explicit BlockReader(std::span<const std::byte> bytes) : left_(bytes) {}

  std::size_t left() const { return left_.size(); }
  std::optional<std::uint64_t> bigEndian(std::size_t width) {
    const auto bytes = take(width);
    if (!bytes) return std::nullopt;
    std::uint64_t value = 0;
    for (const std::byte byte : *bytes) value = value << 8 | std::to_integer<std::uint64_t>(byte);
    return value;
  }
  std::optional<std::span<const std::byte>> take(std::uint64_t count) {
    if (count > left_.size()) return std::nullopt;
    const auto taken = left_.first(count);
    left_ = left_.subspan(count);
    return taken;
  }

 private:
  std::span<const std::byte> left_;
};

bool unpackLz4Block(std::span<const std::byte> packed, std::span<std::byte> out) {
  if (packed.size() > LZ4_MAX_INPUT_SIZE || out.size() > LZ4_MAX_INPUT_SIZE) return false;
  const int got = LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data()), reinterpret_cast<char*>(out.data()),
                                      static_cast<int>(packed.size()), static_cast<int>(out.size()));
  return got >= 0 && static_cast<std::size_t>(got) == out.size();
}

bool unpackZstdBlock(std::span<const std::byte> packed, std::span<std::byte> out) {
  return ZSTD_decompress(out.data(), out.size(), packed.data(), packed.size()) == out.size();
}

// Rows and columns of 8 x 8 bits change places (Warren, Hacker's Delight, 7-3).
std::uint64_t turnedBits(std::uint64_t x) {
  std::uint64_t t = (x ^ x >> 7) & 0x00aa00aa00aa00aa;
  x ^= t ^ t << 7;
  t = (x ^ x >> 14) & 0x0000cccc0000cccc;
  x ^= t ^ t << 14;
  t = (x ^ x >> 28) & 0x00000000f0f0f0f0;
  return x ^ t ^ t << 28;
}

// Bit k of byte b of all samples of a block lies together, the first sample in the lowest bit; a block has a multiple
// of 8 samples.
void gatherBits(std::span<const std::byte> rows, std::size_t width, std::span<std::byte> out) {
  const std::size_t row_bytes = out.size() / width / 8;
  for (std::size_t b = 0; b < width; ++b) {
    const std::byte* from = rows.data() + b * 8 * row_bytes;
    for (std::size_t i = 0; i < row_bytes; ++i) {
      std::uint64_t bits = 0;
      for (std::size_t k = 0; k < 8; ++k) bits |= std::to_integer<std::uint64_t>(from[k * row_bytes + i]) << 8 * k;
      bits = turnedBits(bits);
      for (std::size_t k = 0; k < 8; ++k) out[(8 * i + k) * width + b] = static_cast<std::byte>(bits >> 8 * k);
    }
  }
}

// Samples of a block where the filter does not say how many.
std::size_t usualBlock(std::size_t width) {
  constexpr std::size_t kBlockBytes = 8192;
  constexpr std::size_t kFewest = 128;
  return std::max(kBlockBytes / width / 8 * 8, kFewest);
}

}  // namespace

bool undoLz4Blocks(std::span<const std::byte> packed, std::span<std::byte> out) {
  BlockReader reader(packed);
  const auto all = reader.bigEndian(8);
  const auto block = reader.bigEndian(4);
  if (!all || !block || *all != out.size() || *block == 0) return false;
  while (!out.empty()) {
    const std::size_t wanted = std::min<std::uint64_t>(*block, out.size());
    const auto size = reader.bigEndian(4);
    const auto bytes = size ? reader.take(*size) : std::nullopt;
    if (!bytes) return false;
    if (bytes->size() == wanted) {  // it did not get smaller
      std::ranges::copy(*bytes, out.begin());
    } else if (!unpackLz4Block(*bytes, out.first(wanted))) {
      return false;
    }
    out = out.subspan(wanted);
  }
  return reader.left() == 0;
}

// A byte below 32 says how many follow as they are; another how far back to copy from, and how much.
bool undoLzf(std::span<const std::byte> packed, std::span<std::byte> out) {
  std::size_t in = 0;
  std::size_t done = 0;
  const auto next = [&] { return std::to_integer<std::size_t>(packed[in++]); };
  while (in < packed.size()) {
    const std::size_t control = next();
    if (control < 32) {
      const std::size_t count = control + 1;
      if (count > packed.size() - in || count > out.size() - done) return false;
      std::memcpy(&out[done], &packed[in], count);
      in += count;
      done += count;
      continue;
    }
    std::size_t count = (control >> 5) + 2;
    if (packed.size() - in < (count == 9 ? 2u : 1u)) return false;
    if (count == 9) count += next();
    const std::size_t back = ((control & 31) << 8 | next()) + 1;
    if (back > done || count > out.size() - done) return false;
    for (std::size_t i = 0; i < count; ++i, ++done) out[done] = out[done - back];
  }
  return done == out.size();
}

bool undoBitshuffle(std::span<const std::byte> packed, const Hdf5Filter& filter, std::size_t width,
                    std::span<std::byte> out) {
  constexpr std::uint32_t kLz4 = 2;
  constexpr std::uint32_t kZstd = 3;
  const auto value = [&](std::size_t i) { return i < filter.values.size() ? filter.values[i] : 0; };
  if (value(2) > 0) width = value(2);
  const std::uint32_t codec = value(4);
  if (width == 0 || out.size() % width != 0 || width > out.size() || codec == 1 || codec > kZstd) return false;
  BlockReader reader(packed);
  std::uint64_t block = value(3);
  if (codec != 0) {
    const auto all = reader.bigEndian(8);
    const auto block_bytes = reader.bigEndian(4);
    if (!all || !block_bytes || *all != out.size()) return false;
    block = *block_bytes / width;
  }
  if (block == 0) block = usualBlock(width);
  if (block % 8 != 0) return false;
  std::vector<std::byte> rows;
  while (out.size() >= 8 * width) {
    const std::uint64_t samples = std::min<std::uint64_t>(block, out.size() / width / 8 * 8);
    const auto to = out.first(samples * width);
    if (codec == 0) {
      const auto bytes = reader.take(to.size());
      if (!bytes) return false;
      gatherBits(*bytes, width, to);
    } else {
      rows.resize(to.size());
      const auto size = reader.bigEndian(4);
      const auto bytes = size ? reader.take(*size) : std::nullopt;
      if (!bytes || !(codec == kLz4 ? unpackLz4Block(*bytes, rows) : unpackZstdBlock(*bytes, rows))) return false;
      gatherBits(rows, width, to);
    }
    out = out.subspan(to.size());
  }
  // Up to seven samples are left over, which went as they were.
  const auto rest = reader.take(out.size());
  if (!rest || reader.left() != 0) return false;
  std::ranges::copy(*rest, out.begin());
  return true;
}

}  // namespace blockwalk
