// SPDX-License-Identifier: Apache-2.0
// What every file must stand: wrong fields, wrong records, truncation, flipped bits.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <span>
#include <string>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/file/seal.h"
#include "tests/volume/memory_source.h"

namespace blockwalk::volume_test {

struct FieldCase {
  const char* name;
  std::size_t offset;
  std::string bytes;
  std::string message;
};

// Which checksums are made right: of the header alone where it says no more where the others are.
enum class Sealed { header, all };

// Puts `bytes` at `offset`, makes checksums right, and wants an error that says `message` and names the file.
inline void expectErrors(const std::string& whole, std::span<const FieldCase> cases, Sealed sealed) {
  const ScratchFolder folder;
  for (const FieldCase& field : cases) {
    SCOPED_TRACE(field.name);
    std::string broken = whole;
    broken.replace(field.offset, field.bytes.size(), field.bytes);
    ASSERT_NE(broken, whole);
    if (sealed == Sealed::all) {
      seal(broken);
    } else if (field.offset >= offsetof(FileHeader, type)) {
      sealHeader(broken);
    }
    writeBytes(folder / "broken.bwv", broken);
    const std::string message = messageOf(folder / "broken.bwv");
    EXPECT_THAT(message, testing::HasSubstr(field.message));
    EXPECT_THAT(message, testing::HasSubstr("broken.bwv: "));
  }
}

// Every length below `thorough` and in the last `end` bytes, and every `step`th between.
struct Cuts {
  std::size_t thorough = 0;
  std::size_t end = 0;
  std::size_t step = 1;
};
inline void expectTruncationsFail(const std::string& whole, Cuts cuts) {
  const ScratchFolder folder;
  writeBytes(folder / "cut.bwv", whole);
  ASSERT_NO_THROW(readContents(folder / "cut.bwv"));
  // Downwards in place.
  for (std::size_t size = whole.size(); size-- > 0;) {
    if (size > cuts.thorough && size + cuts.end < whole.size() && size % cuts.step != 0) continue;
    std::filesystem::resize_file(folder / "cut.bwv", size);
    EXPECT_THROW(readContents(folder / "cut.bwv"), DataError) << size;
  }
}

// Flips `count` bits, every other one in the first `near` bytes; returns how many were errors. The others are padding.
inline int expectFlipsAreNoticed(const std::string& whole, int count, std::size_t near) {
  const ScratchFolder folder;
  writeBytes(folder / "flipped.bwv", whole);
  const std::string expected = readContents(folder / "flipped.bwv");
  std::mt19937 random(7);
  int errors = 0;
  for (int i = 0; i < count; ++i) {
    std::string broken = whole;
    const std::size_t at = random() % (i % 2 == 0 ? std::min(near, whole.size()) : whole.size());
    broken[at] = static_cast<char>(broken[at] ^ (1 << random() % 8));
    writeBytes(folder / "flipped.bwv", broken);
    try {
      EXPECT_EQ(readContents(folder / "flipped.bwv"), expected) << "byte " << at;
      EXPECT_TRUE(isPadding(whole, at)) << "byte " << at;
    } catch (const DataError&) {
      ++errors;
    }
  }
  return errors;
}

}  // namespace blockwalk::volume_test
