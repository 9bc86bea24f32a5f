// SPDX-License-Identifier: Apache-2.0
#include "volume/import/slices/tiff_page.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "volume/error.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

std::uint16_t shortField(TIFF* tiff, ttag_t tag, std::uint16_t absent) {
  std::uint16_t value = 0;
  return TIFFGetFieldDefaulted(tiff, tag, &value) == 1 ? value : absent;
}

std::uint32_t longField(TIFF* tiff, ttag_t tag) {
  std::uint32_t value = 0;
  return TIFFGetField(tiff, tag, &value) == 1 ? value : 0;
}

class PageReader {
 public:
  PageReader(TIFF* tiff, const std::string& file_name, int number) : tiff_(tiff), file_(file_name) {
    page_.number = number;
    page_.offset = TIFFCurrentDirOffset(tiff);
  }

  TiffPage read() {
    readSize();
    readPlace();
    readColor();
    readSampleType();
    readPieces();
    return page_;
  }

 private:
  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    failData("{}: page {}: {}", file_, page_.number, fmt::format(format, std::forward<Args>(args)...));
  }

  double resolution(ttag_t tag) const {
    float value = 0;
    return TIFFGetField(tiff_, tag, &value) == 1 && std::isfinite(value) && value > 0 ? value : 0.0;
  }

  void readPlace() {
    std::uint16_t orientation = 0;
    TIFFGetField(tiff_, TIFFTAG_ORIENTATION, &orientation);
    page_.orientation = orientation <= 8 ? orientation : 0;  // beyond, nobody knows what is meant
    page_.resolution = {.x = resolution(TIFFTAG_XRESOLUTION),
                        .y = resolution(TIFFTAG_YRESOLUTION),
                        .unit = shortField(tiff_, TIFFTAG_RESOLUTIONUNIT, RESUNIT_INCH)};
    std::uint32_t depth = 1;
    if (TIFFGetField(tiff_, TIFFTAG_IMAGEDEPTH, &depth) != 1) return;
    if (depth < 1 || depth > static_cast<std::uint32_t>(kMaxDim)) fail("ImageDepth {} must be 1..{}", depth, kMaxDim);
    page_.depth = static_cast<int>(depth);
  }

  void readSize() {
    const std::uint32_t width = longField(tiff_, TIFFTAG_IMAGEWIDTH);
    const std::uint32_t height = longField(tiff_, TIFFTAG_IMAGELENGTH);
    if (width < 1 || width > static_cast<std::uint32_t>(kMaxDim) || height < 1 ||
        height > static_cast<std::uint32_t>(kMaxDim)) {
      fail("ImageWidth {} and ImageLength {} must be 1..{}", width, height, kMaxDim);
    }
    page_.width = static_cast<int>(width);
    page_.height = static_cast<int>(height);
    const std::uint16_t compression = shortField(tiff_, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    if (compression == COMPRESSION_OJPEG || TIFFIsCODECConfigured(compression) == 0) {
      fail("Compression {} cannot be read", compression);
    }
  }

  void readColor() {
    samples_ = shortField(tiff_, TIFFTAG_SAMPLESPERPIXEL, 1);
    std::uint16_t photometric = samples_ == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK;
    TIFFGetField(tiff_, TIFFTAG_PHOTOMETRIC, &photometric);
    const bool jpeg = shortField(tiff_, TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_JPEG;
    if (photometric == PHOTOMETRIC_YCBCR && jpeg) {
      TIFFSetField(tiff_, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);
      photometric = PHOTOMETRIC_RGB;
    }
    switch (photometric) {
      case PHOTOMETRIC_MINISWHITE:
        page_.inverted = true;
        [[fallthrough]];
      case PHOTOMETRIC_MINISBLACK:
        return checkSamples(1, 2);
      case PHOTOMETRIC_RGB:
        return checkSamples(3, 4);
      case PHOTOMETRIC_PALETTE:
        page_.palette = true;
        return checkSamples(1, 1);
      default:
        fail("PhotometricInterpretation {} cannot be read; grey, RGB and palettes can", photometric);
    }
  }

  // `colors` samples, or as many as `most` with alpha behind them.
  void checkSamples(int colors, int most) {
    if (samples_ < colors || samples_ > most) {
      fail("SamplesPerPixel {} cannot be read: with this PhotometricInterpretation it must be {} or {}", samples_,
           colors, most);
    }
    page_.format.channels = page_.palette ? 3 : samples_;
    if (samples_ == colors) return;
    std::uint16_t count = 0;
    std::uint16_t* kinds = nullptr;
    if (TIFFGetField(tiff_, TIFFTAG_EXTRASAMPLES, &count, &kinds) == 1 && count > 0) {
      page_.premultiplied = kinds[0] == EXTRASAMPLE_ASSOCALPHA;
    }
    if (page_.inverted) fail("PhotometricInterpretation WhiteIsZero with alpha cannot be read");
  }

  void readSampleType() {
    page_.bits = shortField(tiff_, TIFFTAG_BITSPERSAMPLE, 1);
    const std::uint16_t kind = shortField(tiff_, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
    const auto type = sampleType(page_.bits, kind);
    if (!type) fail("BitsPerSample {} with SampleFormat {} cannot be read", page_.bits, kind);
    const bool unsigned_integer = kind == SAMPLEFORMAT_UINT || kind == SAMPLEFORMAT_VOID;
    if (page_.inverted && !unsigned_integer) fail("PhotometricInterpretation WhiteIsZero needs unsigned samples");
    if (page_.palette && (!unsigned_integer || page_.bits > 8))
      fail("a palette needs BitsPerSample 1 to 8, not {}", page_.bits);
    if (page_.premultiplied && page_.bits > 16)
      fail("premultiplied alpha needs BitsPerSample 8 or 16, not {}", page_.bits);
    page_.format.type = page_.palette ? SampleType::u16 : *type;
  }

  static std::optional<SampleType> sampleType(int bits, std::uint16_t kind) {
    switch (kind) {
      case SAMPLEFORMAT_UINT:
      case SAMPLEFORMAT_VOID:
        if (bits >= 1 && bits <= 8) return SampleType::u8;
        if (bits >= 9 && bits <= 16) return SampleType::u16;
        if (bits == 32) return SampleType::u32;
        if (bits == 64) return SampleType::u64;
        return std::nullopt;
      case SAMPLEFORMAT_INT:
        if (bits == 8) return SampleType::i8;
        if (bits == 16) return SampleType::i16;
        if (bits == 32) return SampleType::i32;
        if (bits == 64) return SampleType::i64;
        return std::nullopt;
      case SAMPLEFORMAT_IEEEFP:
        if (bits == 16) return SampleType::f16;
        if (bits == 32) return SampleType::f32;
        if (bits == 64) return SampleType::f64;
        return std::nullopt;
      default:
        return std::nullopt;
    }
  }

  void readPieces() {
    page_.planes_apart =
        samples_ > 1 && shortField(tiff_, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == PLANARCONFIG_SEPARATE;
    if (page_.planes_apart && page_.bits % 8 != 0) {
      fail("BitsPerSample {} with PlanarConfiguration 2 cannot be read", page_.bits);
    }
    page_.tiled = TIFFIsTiled(tiff_) != 0;
    std::uint32_t piece_width = static_cast<std::uint32_t>(page_.width);
    std::uint32_t piece_height = 0;
    if (page_.tiled) {
      piece_width = longField(tiff_, TIFFTAG_TILEWIDTH);
      piece_height = longField(tiff_, TIFFTAG_TILELENGTH);
      // TIFF 6.0 has multiples of 16; that also keeps tiles of 1-bit samples on whole bytes.
      if (piece_width % 16 != 0) fail("TileWidth {} is not a multiple of 16", piece_width);
      readTileDepth();
    } else {
      TIFFGetFieldDefaulted(tiff_, TIFFTAG_ROWSPERSTRIP, &piece_height);
      piece_height = std::min(piece_height, static_cast<std::uint32_t>(page_.height));
    }
    constexpr std::uint32_t kMaxPiece = std::uint32_t{1} << 20;
    if (piece_width < 1 || piece_height < 1 || piece_width > kMaxPiece || piece_height > kMaxPiece) {
      fail("its {} are {} x {} pixels, which cannot be", page_.tiled ? "tiles" : "strips", piece_width, piece_height);
    }
    page_.piece_width = static_cast<int>(piece_width);
    page_.piece_height = static_cast<int>(piece_height);
  }

  void readTileDepth() {
    std::uint32_t depth = 1;
    TIFFGetFieldDefaulted(tiff_, TIFFTAG_TILEDEPTH, &depth);
    if (depth < 1 || depth > static_cast<std::uint32_t>(kMaxDim)) fail("TileDepth {} must be 1..{}", depth, kMaxDim);
    page_.piece_depth = static_cast<int>(depth);
  }

  TIFF* tiff_;
  const std::string& file_;
  TiffPage page_;
  int samples_ = 1;
};

}  // namespace

TiffPage readTiffPage(TIFF* tiff, const std::string& file_name, int number) {
  return PageReader(tiff, file_name, number).read();
}

std::string tiffDescription(TIFF* tiff, const std::string& file_name) {
  char* text = nullptr;
  if (TIFFGetField(tiff, TIFFTAG_IMAGEDESCRIPTION, &text) != 1 || text == nullptr) return {};
  const std::size_t bytes = strnlen(text, kMaxDescriptionBytes + 1);
  if (bytes > kMaxDescriptionBytes) {
    failData("{}: ImageDescription: it has more than {} bytes", file_name, kMaxDescriptionBytes);
  }
  return std::string(text, bytes);
}

bool isSecondaryPage(TIFF* tiff) {
  return (longField(tiff, TIFFTAG_SUBFILETYPE) & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) != 0;
}

bool isReducedPage(TIFF* tiff) {
  return (longField(tiff, TIFFTAG_SUBFILETYPE) & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) == FILETYPE_REDUCEDIMAGE;
}

}  // namespace blockwalk
