// SPDX-License-Identifier: Apache-2.0
// What becomes of a file that is cut off, or that has one bit turned.
#pragma once

#include <random>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {

// Every 64th part of the file, and 1000 times one bit: refused, or voxels of some volume, and for a file that is cut
// off of the same.
inline void survivesBreaking(const Scratch& scratch, const std::string& name, const std::string& bytes) {
  const auto read = [&](const std::string& other) -> std::optional<std::string> {
    try {
      return importAll(scratch.write(name, other));
    } catch (const DataError& error) {
      EXPECT_NE(std::string(error.what()), "");
      return std::nullopt;
    }
  };
  const auto whole = read(bytes);
  ASSERT_TRUE(whole.has_value());
  for (std::size_t part = 0; part < 64; ++part) {
    EXPECT_EQ(read(bytes.substr(0, bytes.size() * part / 64)).value_or(*whole), *whole) << part;
  }
  std::mt19937 random(11);
  for (int flip = 0; flip < 1000; ++flip) {
    std::string other = bytes;
    other[random() % other.size()] ^= static_cast<char>(1 << random() % 8);
    read(other);
  }
}

}  // namespace blockwalk
