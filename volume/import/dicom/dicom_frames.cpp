// SPDX-License-Identifier: Apache-2.0
#include "volume/import/dicom/dicom_frames.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr const char* kRle = "1.2.840.10008.1.2.5";

bool isPlainSyntax(const std::string& syntax) {
  return syntax == "1.2.840.10008.1.2" || syntax == "1.2.840.10008.1.2.1" || syntax == "1.2.840.10008.1.2.2" ||
         syntax == "1.2.840.10008.1.2.1.99";
}

std::uint32_t little32(std::span<const std::byte> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + i]);
  return value;
}

// One segment of PackBits, every `step`-th byte of `out` from `first` on. Returns how many it filled.
std::size_t unpackRuns(std::span<const std::byte> segment, std::span<std::byte> out, std::size_t first,
                       std::size_t step) {
  std::size_t at = first;
  std::size_t filled = 0;
  for (std::size_t i = 0; i < segment.size() && at < out.size();) {
    const auto raw = std::to_integer<int>(segment[i++]);
    const int control = raw < 128 ? raw : raw - 256;
    if (control == -128) continue;
    const std::size_t count = static_cast<std::size_t>(control >= 0 ? control + 1 : 1 - control);
    for (std::size_t k = 0; k < count && at < out.size(); ++k, at += step, ++filled) {
      const std::size_t from = control >= 0 ? i + k : i;
      if (from >= segment.size()) return filled;
      out[at] = segment[from];
    }
    i += control >= 0 ? count : 1;
  }
  return filled;
}

// PS3.5, annex G: a segment for each byte of a sample, the highest first, sample after sample.
void unpackRle(const DicomImage& image, std::span<const std::byte> packed, std::span<std::byte> out) {
  constexpr std::size_t kHeaderBytes = 64;
  const auto sample = static_cast<std::size_t>(image.pixels.bits_allocated) / 8;
  const std::size_t segments = sample * static_cast<std::size_t>(image.pixels.samples);
  if (packed.size() < kHeaderBytes || little32(packed, 0) != segments || segments > 15) {
    failData("{}: PixelData: a frame packed by runs must have {} segments", image.name, segments);
  }
  const std::size_t pixel = segments;
  for (std::size_t i = 0; i < segments; ++i) {
    const std::size_t begin = little32(packed, 4 + 4 * i);
    const std::size_t end = i + 1 < segments ? little32(packed, 8 + 4 * i) : packed.size();
    if (begin < kHeaderBytes || begin > end || end > packed.size()) {
      failData("{}: PixelData: segment {} of a frame lies at {} to {} of {} bytes", image.name, i, begin, end,
               packed.size());
    }
    const std::size_t place = i / sample * sample + (sample - 1 - i % sample);
    const std::size_t filled = unpackRuns(packed.subspan(begin, end - begin), out, place, pixel);
    if (filled != out.size() / pixel) {
      failData("{}: PixelData: segment {} of a frame has {} of {} bytes", image.name, i, filled, out.size() / pixel);
    }
  }
}

std::vector<std::byte> packedBytes(const DicomImage& image, std::size_t frame, DicomBytes& file,
                                   std::uint64_t memory_bytes) {
  std::uint64_t bytes = 0;
  for (const DicomPiece& piece : image.pieces[frame]) bytes += piece.bytes;
  if (bytes > memory_bytes) {
    failData("{}: PixelData: a frame takes {} bytes of memory, {} are allowed; raise --memory", image.name, bytes,
             memory_bytes);
  }
  std::vector<std::byte> packed(bytes);
  std::size_t at = 0;
  for (const DicomPiece& piece : image.pieces[frame]) {
    file.read(piece.begin, std::span(packed).subspan(at, piece.bytes));
    at += piece.bytes;
  }
  return packed;
}

void interleavePlanes(std::vector<std::byte>& bytes, std::size_t samples, std::size_t width) {
  std::vector<std::byte> result(bytes.size());
  const std::size_t pixels = bytes.size() / samples / width;
  for (std::size_t plane = 0; plane < samples; ++plane) {
    for (std::size_t i = 0; i < pixels; ++i) {
      std::memcpy(&result[(i * samples + plane) * width], &bytes[(plane * pixels + i) * width], width);
    }
  }
  bytes = std::move(result);
}

// ITU-R BT.601, of the full range (PS3.3, C.7.6.3.1.2).
void toRgb(std::span<std::byte> bytes) {
  const auto clamped = [](double value) {
    return static_cast<std::byte>(static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L)));
  };
  for (std::size_t i = 0; i + 3 <= bytes.size(); i += 3) {
    const double y = std::to_integer<int>(bytes[i]);
    const double b = std::to_integer<int>(bytes[i + 1]) - 128;
    const double r = std::to_integer<int>(bytes[i + 2]) - 128;
    bytes[i] = clamped(y + 1.402 * r);
    bytes[i + 1] = clamped(y - 0.344136 * b - 0.714136 * r);
    bytes[i + 2] = clamped(y + 1.772 * b);
  }
}

// Takes the stored bits out of the allocated ones, extends signs, and turns round what is inverted.
template <typename T>
void takeStoredBits(const DicomPixels& pixels, std::span<std::byte> bytes) {
  using Unsigned = std::make_unsigned_t<T>;
  const int allocated = pixels.bits_allocated;
  const int left = allocated - 1 - pixels.high_bit;
  const int right = allocated - pixels.bits_stored;
  for (std::size_t i = 0; i + sizeof(T) <= bytes.size(); i += sizeof(T)) {
    Unsigned raw{};
    std::memcpy(&raw, &bytes[i], sizeof raw);
    raw = static_cast<Unsigned>(raw << left);
    T value = static_cast<T>(static_cast<T>(raw) >> right);  // arithmetic where T has a sign
    if (pixels.is_inverted) {
      const Unsigned full = static_cast<Unsigned>(static_cast<Unsigned>(~Unsigned{0}) >> right);
      value = pixels.is_signed ? static_cast<T>(~value) : static_cast<T>(full - static_cast<Unsigned>(value));
    }
    std::memcpy(&bytes[i], &value, sizeof value);
  }
}

void takeStored(const DicomPixels& pixels, std::span<std::byte> bytes) {
  if (pixels.is_float) return;
  switch (pixels.bits_allocated) {
    case 1:
      for (std::byte& pixel : bytes) pixel ^= std::byte{static_cast<unsigned char>(pixels.is_inverted ? 1 : 0)};
      return;
    case 8:
      return pixels.is_signed ? takeStoredBits<std::int8_t>(pixels, bytes)
                              : takeStoredBits<std::uint8_t>(pixels, bytes);
    case 16:
      return pixels.is_signed ? takeStoredBits<std::int16_t>(pixels, bytes)
                              : takeStoredBits<std::uint16_t>(pixels, bytes);
    default:
      return pixels.is_signed ? takeStoredBits<std::int32_t>(pixels, bytes)
                              : takeStoredBits<std::uint32_t>(pixels, bytes);
  }
}

// A byte a pixel of a frame whose bits lie behind those of the frame before, the lowest of a byte first.
void readBits(const DicomImage& image, std::size_t frame, DicomBytes& file, std::span<std::byte> bytes) {
  const DicomPiece& piece = image.pieces[frame][0];
  std::vector<std::byte> packed(piece.bytes);
  file.read(piece.begin, packed);
  std::uint64_t bit = frame * image.pixels.frameBytes() % 8;
  for (std::byte& pixel : bytes) {
    pixel = packed[bit / 8] >> static_cast<int>(bit % 8) & std::byte{1};
    ++bit;
  }
}

template <typename T>
void colorPixels(const DicomPalette& palette, const std::vector<std::uint16_t>& colors,
                 std::span<const std::byte> bytes, std::span<std::byte> out) {
  const std::size_t width = palette.bits == 8 ? 1 : 2;
  for (std::size_t i = 0; i < bytes.size() / sizeof(T); ++i) {
    T value{};
    std::memcpy(&value, &bytes[i * sizeof value], sizeof value);
    const auto entry = static_cast<std::size_t>(std::clamp(int{value} - palette.first, 0, palette.entries - 1));
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint16_t sample = colors[entry * 3 + c];
      const auto narrow = static_cast<std::uint8_t>(sample);
      std::memcpy(&out[(i * 3 + c) * width], width == 1 ? static_cast<const void*>(&narrow) : &sample, width);
    }
  }
}

std::vector<std::byte> colored(const DicomImage& image, std::span<const std::byte> bytes) {
  const DicomPalette& palette = *image.palette;
  const std::vector<std::uint16_t> colors = expandPalette(palette, image.name);
  const SampleType type = image.pixels.storedFormat().type;
  std::vector<std::byte> out(bytes.size() / sampleBytes(type) * image.pixels.format().voxelBytes());
  if (type == SampleType::u8) colorPixels<std::uint8_t>(palette, colors, bytes, out);
  if (type == SampleType::i8) colorPixels<std::int8_t>(palette, colors, bytes, out);
  if (type == SampleType::u16) colorPixels<std::uint16_t>(palette, colors, bytes, out);
  if (type == SampleType::i16) colorPixels<std::int16_t>(palette, colors, bytes, out);
  return out;
}

}  // namespace

DicomBytes openDicomBytes(const DicomImage& image) {
  DicomBytes file(image.path);
  if (image.deflated_from > 0) file.inflateFrom(image.deflated_from);
  return file;
}

bool canReadDicom(const std::string& transfer_syntax) {
  return isPlainSyntax(transfer_syntax) || transfer_syntax == kRle || canUnpackDicom(transfer_syntax);
}

std::vector<std::byte> readDicomFrame(const DicomImage& image, std::size_t frame, DicomBytes& file,
                                      std::uint64_t memory_bytes) {
  const DicomPixels& pixels = image.pixels;
  // The frame, the same once more while it is put in order, and its packed bytes; or its colours.
  const std::uint64_t colors = pixels.frameBytes() / pixels.storedFormat().voxelBytes() * pixels.format().voxelBytes();
  const std::uint64_t needed = std::max(3 * pixels.frameBytes(), pixels.frameBytes() + colors);
  if (needed > memory_bytes) {
    failData("{}: Rows and Columns: a frame of {} bytes takes {} of memory, {} are allowed; raise --memory", image.name,
             pixels.frameBytes(), needed, memory_bytes);
  }
  std::vector<std::byte> bytes(pixels.frameBytes());
  const auto width = static_cast<std::size_t>(pixels.bits_allocated) / 8;
  bool is_planar = pixels.is_planar;
  if (pixels.bits_allocated == 1) {
    readBits(image, frame, file, bytes);
  } else if (!image.is_packed) {
    file.read(image.pieces[frame][0].begin, bytes);
    if (image.is_big_endian != (std::endian::native == std::endian::big) && width > 1) {
      for (std::size_t i = 0; i < bytes.size(); i += width) std::reverse(&bytes[i], &bytes[i] + width);
    }
  } else {
    const std::vector<std::byte> packed = packedBytes(image, frame, file, memory_bytes / 3);
    if (image.transfer_syntax == kRle) {
      unpackRle(image, packed, bytes);
    } else {
      unpackDicomFrame(image, packed, bytes, memory_bytes);
    }
    is_planar = false;
  }
  if (is_planar) interleavePlanes(bytes, static_cast<std::size_t>(pixels.samples), width);
  if (pixels.is_ybr) toRgb(bytes);
  takeStored(pixels, bytes);
  if (image.palette) return colored(image, bytes);
  return bytes;
}

}  // namespace blockwalk
