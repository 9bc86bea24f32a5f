// SPDX-License-Identifier: Apache-2.0
// Files that are cut off, or that have one bit turned.
#pragma once

#include <random>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {

// Every 64th part: visit(bytes).
template <typename Visit>
void forEachCut(const std::string& whole, Visit visit) {
  for (std::size_t part = 0; part < 64; ++part) visit(whole.substr(0, whole.size() * part / 64));
}

// 1000 times one bit: visit(bytes).
template <typename Visit>
void forEachFlippedBit(const std::string& whole, Visit visit) {
  std::mt19937 random(11);
  for (int flip = 0; flip < 1000; ++flip) {
    std::string broken = whole;
    const auto bit = random() % (8 * broken.size());
    broken[bit / 8] = static_cast<char>(broken[bit / 8] ^ (1 << bit % 8));
    visit(broken);
  }
}

// The same of formats in which one bit makes a volume of any size, of which a large one is only opened; with a bound on
// memory.
inline void survivesBreakingInBounds(const Scratch& scratch, const std::string& name, const std::string& bytes) {
  ImportOptions options;
  options.memory_bytes = std::uint64_t{64} << 20;
  const auto outcome = [&](const std::string& other) -> std::optional<std::string> {
    try {
      const auto source = openSource({scratch.write(name, other)}, options);
      const glm::dvec3 dims(source->info().dims);
      return dims.x * dims.y * dims.z > 1e6 ? "large" : readAll(*source);
    } catch (const DataError& error) {
      EXPECT_NE(std::string(error.what()), "");
      return std::nullopt;
    }
  };
  const auto right = outcome(bytes);
  ASSERT_TRUE(right.has_value());
  forEachCut(bytes, [&](const std::string& cut) { EXPECT_EQ(outcome(cut).value_or(*right), *right) << cut.size(); });
  int read = 0;
  forEachFlippedBit(bytes, [&](const std::string& broken) { read += outcome(broken) ? 1 : 0; });
  EXPECT_GT(read, 0);
}

// Refused, or voxels of some volume, and of a file that is cut off of the same. `source`: what is imported, where the
// file is only a part of that.
inline void survivesBreaking(const Scratch& scratch, const std::string& name, const std::string& bytes,
                             const std::string& source = {}) {
  const auto read = [&](const std::string& other) -> std::optional<std::string> {
    try {
      scratch.write(name, other);
      return importAll(scratch.path(source.empty() ? name : source));
    } catch (const DataError& error) {
      EXPECT_NE(std::string(error.what()), "");
      return std::nullopt;
    }
  };
  const auto whole = read(bytes);
  ASSERT_TRUE(whole.has_value());
  forEachCut(bytes, [&](const std::string& cut) { EXPECT_EQ(read(cut).value_or(*whole), *whole) << cut.size(); });
  forEachFlippedBit(bytes, read);
  scratch.write(name, bytes);
}

}  // namespace blockwalk
