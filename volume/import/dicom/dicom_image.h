// SPDX-License-Identifier: Apache-2.0
// The frames of one DICOM file: what their pixels are, where each lies, and what its values mean.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "volume/import/convert/sample.h"
#include "volume/import/dicom/dicom_palette.h"
#include "volume/import/dicom/dicom_set.h"
#include "volume/volume.h"

namespace blockwalk {

// How the pixels of a file lie, alike in all of its frames.
struct DicomPixels {
  int width = 0;
  int height = 0;
  int samples = 1;         // a pixel: 1, or 3 of a colour
  int bits_allocated = 8;  // a sample: 8, 16, 32 or 64; 1: eight pixels a byte, a byte each once they are read
  int bits_stored = 8;
  int high_bit = 7;
  bool is_signed = false;
  bool is_float = false;
  bool is_planar = false;    // a plane for each colour
  bool is_ybr = false;       // luminance and differences, not red, green and blue
  bool is_inverted = false;  // MONOCHROME1: the least value is the brightest
  int palette_bits = 0;      // of a colour that a sample stands for; 0: it stands for none
  bool operator==(const DicomPixels&) const = default;

  SampleFormat format() const;        // what readDicomFrame() gives
  SampleFormat storedFormat() const;  // before a palette
  std::uint64_t frameBytes() const {
    return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) *
           static_cast<std::uint64_t>(samples) * static_cast<std::uint64_t>((bits_allocated + 7) / 8);
  }
};

struct DicomFrame {
  std::size_t file = 0;   // of a series
  std::size_t index = 0;  // in its file
  bool has_position = false;
  glm::dvec3 position{0};  // the centre of its first pixel, millimetres
  double slope = 1;
  double intercept = 0;
  std::int64_t number = 0;  // InstanceNumber
  int segment = 0;          // that it belongs to; 0: to none
};

struct DicomImage {
  std::string name;
  std::filesystem::path path;
  std::string series;  // SeriesInstanceUID
  std::string modality;
  std::string unit;  // of values
  DicomPixels pixels;
  std::shared_ptr<const DicomPalette> palette;          // null: none
  std::string segmentation;                             // "BINARY", "FRACTIONAL" or "LABELMAP"; empty: it is none
  std::vector<LabelInfo> segments;                      // by number
  int full_fraction = 255;                              // of FRACTIONAL: the value that is all
  std::optional<std::array<glm::dvec3, 2>> directions;  // of a row and of a column, unit vectors
  std::optional<glm::dvec2> spacing;                    // of pixels along a row, along a column; millimetres
  double thickness = 0;                                 // from frame to frame, as far as it is said; 0: it is not
  bool is_thickness_guessed = false;
  bool is_step_said = false;  // thickness is SpacingBetweenSlices
  std::vector<DicomFrame> frames;
  std::string transfer_syntax;
  bool is_big_endian = false;
  std::uint64_t deflated_from = 0;  // as in DicomFile
  bool is_packed = false;
  std::string step_field;  // of frames at one position: what says how far apart they are; empty: they have their own
  std::vector<std::vector<DicomPiece>> pieces;  // of each frame; of one bit a pixel with the bits of its neighbours
};

// Nothing where the file holds no pixels. Throws DataError naming the element and the bound.
std::optional<DicomImage> readDicomImage(const std::filesystem::path& path);

}  // namespace blockwalk
