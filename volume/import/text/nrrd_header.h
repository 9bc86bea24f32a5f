// SPDX-License-Identifier: Apache-2.0
// The header of a NRRD file (teem.sourceforge.net/nrrd/format.html), interpreted.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "volume/import/convert/sample.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/geometry.h"
#include "volume/import/input_file.h"
#include "volume/source.h"

namespace blockwalk {

enum class NrrdEncoding { raw, gzip, bzip2, text, hex };

struct NrrdHeader {
  SampleFormat format;
  bool is_color = true;                   // where a voxel has several samples
  ArrayOrder order = ArrayOrder::voxels;  // planes: the samples' axis is the last one
  glm::ivec3 dims{0};
  std::int64_t frames = 1;     // volumes one after the other
  Geometry geometry;           // right-handed
  std::string spacing_fields;  // that say it; empty: none does
  std::string space;           // what its axes are; empty where the field is missing
  std::string length_unit;     // where all axes of space have the same
  std::string sample_unit;
  std::vector<SourceChannel> channels;  // what keys of our own say of each; of a colour there is one
  std::vector<std::string> notes;
  NrrdEncoding encoding = NrrdEncoding::raw;
  std::vector<std::int64_t> sizes;  // as they stand in the file
  std::string data_file;            // empty: the data follows the header, or is listed
  std::optional<int> list_axes;     // of a list: see axesOfList()
  std::vector<std::string> listed;  // its files
  std::uint64_t data_begin = 0;     // attached: offset behind the header
  std::uint64_t line_skip = 0;
  std::int64_t byte_skip = 0;  // -1: the data is the last of the bytes
};

// Throws DataError naming the field. Three axes are a volume, two are one slice, and one is one row. An axis of three
// or four in front of them is colour when `kinds` calls it one, or when it is the first of four, u8, and `kinds` calls
// it nothing else. An axis of two to four in front of them or behind them is channels when `kinds` calls it a list or a
// vector. Axes of length 1 beyond those say nothing; another one behind them is of frames, and also one that would be
// channels where a frame `is_chosen`.
NrrdHeader readNrrdHeader(const InputFile& file, bool is_chosen);

}  // namespace blockwalk
