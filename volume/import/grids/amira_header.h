// SPDX-License-Identifier: Apache-2.0
// The text in front of an Amira mesh: what is there, and how it lies behind.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

enum class AmiraBytes { little, big, text };

// "Lattice { ushort Data } @1(HxZip,5678)"
struct AmiraField {
  std::string holder = {};
  std::string type = {};
  std::int64_t components = 1;
  std::string name = {};
  std::string packing = {};  // empty, HxByteRLE or HxZip
  std::uint64_t packed_bytes = 0;
  std::string marker = {};  // "@1"
};

struct AmiraHeader {
  AmiraBytes bytes = AmiraBytes::text;
  std::map<std::string, std::vector<std::int64_t>> sizes;      // what is defined
  std::map<std::string, std::vector<std::string>> parameters;  // by path: "Units.Coordinates"
  std::vector<std::string> materials;                          // names, in their order
  std::vector<AmiraField> fields;
  std::string first_marker;
  std::uint64_t data_begin = 0;
};

bool startsLikeAmira(std::string_view text);

// Throws DataError naming the file and the field.
AmiraHeader readAmiraHeader(const InputFile& file);

}  // namespace blockwalk
