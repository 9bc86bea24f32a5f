// SPDX-License-Identifier: Apache-2.0
// TIFF files of many kinds for tests, and the samples that they must give.
#pragma once

#include <tiffio.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {
struct PageKind {
  int width = 20;
  int height = 18;
  int bits = 8;
  int samples = 1;
  int photometric = PHOTOMETRIC_MINISBLACK;
  int sample_format = SAMPLEFORMAT_UINT;
  int planar = PLANARCONFIG_CONTIG;
  int compression = COMPRESSION_NONE;
  int rows_per_strip = 5;
  int tile = 0;
  int alpha = EXTRASAMPLE_UNASSALPHA;
  const char* description = nullptr;
  int orientation = 0;  // 0: not said
  float x_resolution = 0;
  float y_resolution = 0;
  int resolution_unit = 0;
};

inline void setFields(TIFF* tiff, const PageKind& kind) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kind.width);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kind.height);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.samples);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind.photometric);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, kind.sample_format);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, kind.planar);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind.compression);
  const std::uint16_t extra = static_cast<std::uint16_t>(kind.alpha);
  if (kind.samples == 2 || kind.samples == 4) TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &extra);
  if (kind.description != nullptr) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, kind.description);
  if (kind.orientation > 0) TIFFSetField(tiff, TIFFTAG_ORIENTATION, kind.orientation);
  if (kind.x_resolution > 0) TIFFSetField(tiff, TIFFTAG_XRESOLUTION, static_cast<double>(kind.x_resolution));
  if (kind.y_resolution > 0) TIFFSetField(tiff, TIFFTAG_YRESOLUTION, static_cast<double>(kind.y_resolution));
  if (kind.resolution_unit > 0) TIFFSetField(tiff, TIFFTAG_RESOLUTIONUNIT, kind.resolution_unit);
  if (kind.tile > 0) {
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, kind.tile);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, kind.tile);
  } else {
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, kind.rows_per_strip);
  }
}

// One sample of page, pixel and channel: different everywhere, so that nothing can be swapped unseen.
inline std::uint32_t sampleAt(int page, int x, int y, int channel) {
  return static_cast<std::uint32_t>(page * 7919 + y * 1009 + x * 31 + channel * 5);
}

inline void putSample(std::string& bytes, std::size_t index, int bits, std::uint32_t value) {
  if (bits == 8) bytes[index] = static_cast<char>(value);
  if (bits == 16) {
    const auto narrow = static_cast<std::uint16_t>(value);
    std::memcpy(&bytes[index * 2], &narrow, 2);
  }
  if (bits == 32) {
    const auto real = static_cast<float>(value);
    std::memcpy(&bytes[index * 4], &real, 4);
  }
}

// Interleaved samples of a page.
inline std::string pixelsOf(const PageKind& kind, int page) {
  std::string bytes(static_cast<std::size_t>(kind.width * kind.height * kind.samples * kind.bits / 8), '\0');
  std::size_t index = 0;
  for (int y = 0; y < kind.height; ++y) {
    for (int x = 0; x < kind.width; ++x) {
      for (int c = 0; c < kind.samples; ++c) putSample(bytes, index++, kind.bits, sampleAt(page, x, y, c));
    }
  }
  return bytes;
}

inline void writeTiles(TIFF* tiff, const PageKind& kind, int page) {
  const bool apart = kind.planar == PLANARCONFIG_SEPARATE;
  const int in_tile = apart ? 1 : kind.samples;
  for (int plane = 0; plane < (apart ? kind.samples : 1); ++plane) {
    for (int y0 = 0; y0 < kind.height; y0 += kind.tile) {
      for (int x0 = 0; x0 < kind.width; x0 += kind.tile) {
        std::string tile(static_cast<std::size_t>(TIFFTileSize(tiff)), '\0');
        for (int y = 0; y < kind.tile; ++y) {
          for (int x = 0; x < kind.tile; ++x) {
            for (int c = 0; c < in_tile; ++c) {
              putSample(tile, static_cast<std::size_t>((y * kind.tile + x) * in_tile + c), kind.bits,
                        sampleAt(page, x0 + x, y0 + y, plane + c));
            }
          }
        }
        TIFFWriteTile(tiff, tile.data(), static_cast<std::uint32_t>(x0), static_cast<std::uint32_t>(y0), 0,
                      static_cast<std::uint16_t>(plane));
      }
    }
  }
}

inline void writeRows(TIFF* tiff, const PageKind& kind, int page) {
  const bool apart = kind.planar == PLANARCONFIG_SEPARATE;
  const int in_row = apart ? 1 : kind.samples;
  for (int plane = 0; plane < (apart ? kind.samples : 1); ++plane) {
    for (int y = 0; y < kind.height; ++y) {
      std::string row(static_cast<std::size_t>(kind.width * in_row * kind.bits / 8), '\0');
      for (int x = 0; x < kind.width; ++x) {
        for (int c = 0; c < in_row; ++c) {
          putSample(row, static_cast<std::size_t>(x * in_row + c), kind.bits, sampleAt(page, x, y, plane + c));
        }
      }
      TIFFWriteScanline(tiff, row.data(), static_cast<std::uint32_t>(y), static_cast<std::uint16_t>(plane));
    }
  }
}

// mode: "w" and "wb" big-endian, "wl" little-endian, "w8" BigTIFF
inline std::filesystem::path writeTiff(const Scratch& scratch, const PageKind& kind, int pages = 1,
                                       const char* mode = "w", const std::string& name = "a.tif") {
  TIFF* tiff = TIFFOpen(scratch.path(name).c_str(), mode);
  for (int page = 0; page < pages; ++page) {
    setFields(tiff, kind);
    kind.tile > 0 ? writeTiles(tiff, kind, page) : writeRows(tiff, kind, page);
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  return scratch.path(name);
}

inline std::filesystem::path writePacked(const Scratch& scratch, const PageKind& kind, std::string row,
                                         const std::function<void(TIFF*)>& more = {}) {
  TIFF* tiff = TIFFOpen(scratch.path("packed.tif").c_str(), "w");
  setFields(tiff, kind);
  if (more) more(tiff);
  TIFFWriteScanline(tiff, row.data(), 0, 0);
  TIFFClose(tiff);
  return scratch.path("packed.tif");
}

}  // namespace blockwalk
