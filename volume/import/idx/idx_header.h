// SPDX-License-Identifier: Apache-2.0
// The header of an OpenVisus volume (.idx, version 6): text, with the voxels in files of blocks beside it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "volume/import/convert/sample.h"
#include "volume/import/geometry.h"
#include "volume/import/idx/idx_bits.h"
#include "volume/import/import.h"
#include "volume/import/input_file.h"

namespace blockwalk {

struct IdxField {
  std::string name;
  SampleFormat format = {};
  double default_value = 0;  // where a block is not there
};

struct IdxHeader {
  glm::ivec3 first{0};  // of the voxels that are there, in the box of all that the bits tell from each other
  glm::ivec3 dims{0};
  IdxBits bits;
  int block_bits = 0;  // a block has 2^block_bits samples that lie one after the other
  std::uint64_t blocks_per_file = 0;
  std::vector<IdxField> fields;  // of one single value each, or one alone
  std::string file_template;     // "./name/%02x/%04x.bin"; of the step in time that is meant
  std::vector<std::string> notes;
  Geometry geometry;
  std::string spacing_field;  // that says it; empty: none does

  std::uint64_t blocks() const { return std::uint64_t{1} << (bits.count() - block_bits); }
  std::uint64_t blockSamples() const { return std::uint64_t{1} << block_bits; }
  // File that holds a block, from the header's folder. Throws DataError, naming `source`.
  std::string fileOf(std::uint64_t block, const std::string& source) const;
};

// Throws DataError naming the field and the bound.
IdxHeader readIdxHeader(const InputFile& file, const ImportOptions& options);

}  // namespace blockwalk
