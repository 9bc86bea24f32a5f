// SPDX-License-Identifier: Apache-2.0
// Rows of a TIFF page as samples, out of bands.
#include <algorithm>
#include <cstring>

#include "volume/import/slices/tiff_decoder.h"

namespace blockwalk {
namespace {

// max - v is ~v for unsigned samples of every width
void invert(std::span<std::byte> samples) {
  for (std::byte& part : samples) part = ~part;
}

// Samples of up to 16 bits, one after the other, the highest bit first.
class BitReader {
 public:
  BitReader(const std::byte* bytes, unsigned bits) : bytes_(bytes), bits_(bits) {}
  unsigned next() {
    while (have_ < bits_) {
      held_ = held_ << 8 | std::to_integer<unsigned>(*bytes_++);
      have_ += 8;
    }
    have_ -= bits_;
    return held_ >> have_ & ((1u << bits_) - 1);
  }

 private:
  const std::byte* bytes_;
  unsigned bits_;
  unsigned held_ = 0;
  unsigned have_ = 0;
};

// Colour was multiplied by alpha; the quotient is rounded and never above full.
template <typename T>
void divideByAlpha(std::span<std::byte> row, std::size_t channels) {
  std::vector<T> pixel(channels);
  for (std::size_t i = 0; i + channels * sizeof(T) <= row.size(); i += channels * sizeof(T)) {
    std::memcpy(pixel.data(), &row[i], channels * sizeof(T));
    const std::uint64_t alpha = pixel.back();
    constexpr std::uint64_t kFull = std::numeric_limits<T>::max();
    for (std::size_t c = 0; c + 1 < channels && alpha > 0; ++c) {
      pixel[c] = static_cast<T>(std::min(kFull, (pixel[c] * kFull + alpha / 2) / alpha));
    }
    std::memcpy(&row[i], pixel.data(), channels * sizeof(T));
  }
}

}  // namespace

void TiffFile::Decoder::expandRow(const std::byte* packed, std::span<std::byte> out) const {
  const TiffPage& chosen = pages[page];
  const auto channels = static_cast<std::size_t>(chosen.format.channels);
  if (chosen.bits % 8 == 0 && !chosen.palette) {
    std::memcpy(out.data(), packed, out.size());
    if (chosen.inverted) invert(out);
  } else {
    const unsigned full = (1u << chosen.bits) - 1;
    const std::size_t width = sampleBytes(chosen.format.type);
    BitReader reader(packed, static_cast<unsigned>(chosen.bits));
    for (std::size_t i = 0; i < static_cast<std::size_t>(chosen.width) * static_cast<std::size_t>(samples); ++i) {
      const unsigned value = reader.next();
      if (chosen.palette) {
        std::memcpy(&out[i * 6], &colors[std::size_t{value} * 3], 6);
        continue;
      }
      const auto sample = static_cast<std::uint16_t>(chosen.inverted ? full - value : value);
      std::memcpy(&out[i * width], &sample, width);
    }
  }
  if (chosen.premultiplied && chosen.format.type == SampleType::u8) divideByAlpha<std::uint8_t>(out, channels);
  if (chosen.premultiplied && chosen.format.type == SampleType::u16) divideByAlpha<std::uint16_t>(out, channels);
}

void TiffFile::Decoder::readStoredRow(int y, std::span<std::byte> out) {
  const TiffPage& chosen = pages[page];
  if (band != y / chosen.piece_height) decodeBand(y / chosen.piece_height);
  expandRow(rows.get() + static_cast<std::size_t>(y % chosen.piece_height) * row_bytes, out);
}

// A column of the stored rows, which are held until the next page.
void TiffFile::Decoder::readTurnedRow(int y, std::span<std::byte> out) {
  const TiffPage& chosen = pages[page];
  const std::size_t pixel = chosen.format.voxelBytes();
  const std::size_t stored_row = static_cast<std::size_t>(chosen.width) * pixel;
  if (turned.empty()) {
    turned.resize(stored_row * static_cast<std::size_t>(chosen.height));
    for (int row = 0; row < chosen.height; ++row) {
      readStoredRow(row, std::span(turned).subspan(static_cast<std::size_t>(row) * stored_row, stored_row));
    }
  }
  const bool from_right = chosen.orientation == 6 || chosen.orientation == 7;   // the first row is the right side
  const bool from_bottom = chosen.orientation == 7 || chosen.orientation == 8;  // the first column is the bottom
  const int column = from_bottom ? chosen.width - 1 - y : y;
  for (int x = 0; x < chosen.height; ++x) {
    const int row = from_right ? chosen.height - 1 - x : x;
    std::memcpy(&out[static_cast<std::size_t>(x) * pixel],
                &turned[static_cast<std::size_t>(row) * stored_row + static_cast<std::size_t>(column) * pixel], pixel);
  }
}

}  // namespace blockwalk
