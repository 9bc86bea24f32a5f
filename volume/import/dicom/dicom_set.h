// SPDX-License-Identifier: Apache-2.0
// The data set of a DICOM file (PS3.5, PS3.10): those of its elements that say what the pixels are and where they lie.
// No other is kept, so that nothing of a person is.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "volume/import/dicom/dicom_bytes.h"

namespace blockwalk {

// Group and element.
constexpr std::uint32_t dicomTag(std::uint32_t group, std::uint32_t element) { return group << 16 | element; }

struct DicomSet {
  std::map<std::uint32_t, std::string> values;           // bytes of elements, without the padding of texts
  std::map<std::uint32_t, std::vector<DicomSet>> items;  // of sequences

  // Nothing where the element is missing or empty.
  std::string text(std::uint32_t tag) const;
  // The set of the first item of a sequence; nothing where there is none.
  const DicomSet* item(std::uint32_t sequence, std::size_t index = 0) const;
};

struct DicomPiece {
  std::uint64_t begin = 0;  // in the file
  std::uint64_t bytes = 0;
};

struct DicomFile {
  std::string name;
  std::string transfer_syntax;
  bool is_big_endian = false;
  std::uint64_t deflated_from = 0;  // byte where the deflated data set begins; 0: it is not deflated
  DicomSet set;
  bool has_pixels = false;
  bool is_float = false;               // FloatPixelData and DoubleFloatPixelData
  bool is_packed = false;              // in fragments; else one piece
  std::vector<DicomPiece> pieces;      // of the pixels, without the offset table
  std::vector<std::uint32_t> offsets;  // the table: of each frame, from the first fragment's item on

  // Throw DataError, naming the element, where it is no number.
  std::optional<std::int64_t> whole(const DicomSet& from, std::uint32_t tag) const;  // US
  std::vector<int> wholes(const DicomSet& from, std::uint32_t tag) const;            // US
  std::vector<double> reals(const DicomSet& from, std::uint32_t tag) const;          // DS, IS: separated by backslashes
};

// Whether a file begins with these bytes that is DICOM: with a preamble and its word, or without, where other formats
// may begin alike.
bool startsLikeDicom(std::string_view start);
bool startsLikeBareDicom(std::string_view start);

// Throws DataError naming the element and the bound.
DicomFile readDicomFile(DicomBytes& file);

}  // namespace blockwalk
