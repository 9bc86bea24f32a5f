// SPDX-License-Identifier: Apache-2.0
#include <glm/glm.hpp>

#include "tests/volume/import/broken.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

// Packs as the coder does, from its description: another way round than the program goes.
class DdsWriter {
 public:
  std::string pack(std::string bytes, unsigned width, unsigned strip, std::size_t block) {
    bytes = apart(bytes, width, block);
    put(width - 1, 2);
    put(strip - 1, 16);
    int value = 0;
    for (std::size_t at = 0; at < bytes.size();) {
      std::vector<int> steps;
      int widest = 0;
      for (; at < bytes.size() && steps.size() < 100; ++at) {
        const int now = static_cast<unsigned char>(bytes[at]);
        int step = now - value;
        if (strip > 1 && at > strip) {
          step -= static_cast<unsigned char>(bytes[at - strip]) - static_cast<unsigned char>(bytes[at - strip - 1]);
        }
        step = (step % 256 + 256 + 128) % 256 - 128;
        value = now;
        steps.push_back(step);
        int bits = step == 0 ? 0 : 2;
        while (bits > 0 && (step < -(1 << bits) / 2 || step >= (1 << bits) / 2)) ++bits;
        widest = std::max(widest, bits);
      }
      put(static_cast<unsigned>(steps.size()), 7);
      put(static_cast<unsigned>(widest > 0 ? widest - 1 : 0), 3);
      for (const int step : steps) put(static_cast<unsigned>(step + (1 << widest) / 2), static_cast<unsigned>(widest));
    }
    put(0, 7);
    put(0, 7);
    std::string packed;
    for (std::size_t i = 0; i + 8 <= bits_.size(); i += 8) {
      int byte = 0;
      for (std::size_t k = 0; k < 8; ++k) byte = 2 * byte + bits_[i + k];
      packed += static_cast<char>(byte);
    }
    return packed;
  }

 private:
  // All first bytes, all second ones and so on, of so many voxels at a time.
  static std::string apart(const std::string& bytes, std::size_t width, std::size_t block) {
    std::string result;
    const std::size_t whole = block == 0 ? bytes.size() : block * width;
    for (std::size_t begin = 0; begin < bytes.size(); begin += whole) {
      const std::size_t end = std::min(bytes.size(), begin + whole);
      for (std::size_t first = 0; first < width; ++first) {
        for (std::size_t at = begin + first; at < end; at += width) result += bytes[at];
      }
    }
    return result;
  }
  void put(unsigned value, unsigned count) {
    for (unsigned i = count; i-- > 0;) bits_.push_back(value >> i & 1);
  }

  std::vector<int> bits_;
};

std::string wave(std::size_t count) {
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) bytes += static_cast<char>(i < 300 ? 5 : i * i / 50);
  return bytes;
}

TEST(Pvm, ReadsEveryVersion) {
  const Scratch scratch;
  const std::string voxels = wave(10 * 9 * 8);
  EXPECT_EQ(importAll(scratch.write("a.pvm", "PVM\n# a comment\n10 9 8\n1\n" + voxels)), voxels);
  const auto scaled = openSource({scratch.write("a.pvm", "PVM2\n10 9 8\n1 2 0.5\n1\n" + voxels)}, {});
  EXPECT_EQ(worldOf(scaled->info(), {1, 1, 1}), glm::dvec3(1, 2, 0.5));
  EXPECT_EQ(readAll(*scaled), voxels);
  EXPECT_EQ(importAll(scratch.write("a.pvm", "PVM3\n10 9 4\n1 1 1\n2\n" + voxels + std::string("text\0\0\0\0", 8))),
            swapped(voxels, 2));
}

TEST(Pvm, UnpacksDifferences) {
  const Scratch scratch;
  for (const unsigned strip : {1u, 10u, 65536u}) {
    for (const unsigned width : {1u, 2u, 3u}) {
      const std::string file = "PVM2\n10 9 4\n1 1 1\n2\n" + wave(720) + "\n";
      EXPECT_EQ(importAll(scratch.write("a.pvm", "DDS v3d\n" + DdsWriter().pack(file, width, strip, 0))),
                swapped(wave(720), 2));
      EXPECT_EQ(
          importAll(scratch.write("a.pvm", "DDS v3e\n" + DdsWriter().pack(file, width, strip, std::size_t{1} << 24))),
          swapped(wave(720), 2));
    }
  }
}

TEST(Pvm, BrokenFilesAreRefusedByNameAndBound) {
  const Scratch scratch;
  const auto refusalOf = [&](const std::string& text) { return refusal({scratch.write("a.pvm", text)}); };
  EXPECT_THAT(refusalOf("PVM\n10 9\n1\n"), HasSubstr("a.pvm: size: 2 numbers are given, not 3"));
  EXPECT_THAT(refusalOf("PVM\n10 9 0\n1\n"), HasSubstr("size: 0 is outside 1..65536"));
  EXPECT_THAT(refusalOf("PVM\n10 9 8\n3\n"), HasSubstr("components: 3 cannot be read"));
  EXPECT_THAT(refusalOf("PVM2\n10 9 8\n1 0 1\n1\n"), HasSubstr("scale: the step along axis 1 has length 0"));
  EXPECT_THAT(refusalOf("PVM\n10 9 8\n1\nshort"),
              HasSubstr("720 bytes of voxels from byte 13 were declared, the file has 18"));
  EXPECT_THAT(refusalOf("PVM\n10 9 8"), HasSubstr("the header does not end"));
  EXPECT_THAT(refusalOf("DDS v3d\n" + DdsWriter().pack("PVM\n10 9 8\n1\nshort", 1, 1, 0)),
              HasSubstr("720 bytes of voxels from byte 13 are declared, 18 are unpacked"));
  // A hundred bytes of 10 bits, over and over.
  const std::string bomb = DdsWriter().pack(std::string(std::size_t{17} << 20, 'b'), 1, 1, 0);
  EXPECT_LT(bomb.size(), std::size_t{1} << 22);
  ImportOptions small;
  small.memory_bytes = std::uint64_t{64} << 20;
  EXPECT_THAT(refusal({scratch.write("a.pvm", "DDS v3d\n" + bomb)}, small),
              HasSubstr("DDS: unpacks to more than 16777216 bytes"));
}

TEST(Pvm, SurvivesBreaking) {
  const Scratch scratch;
  survivesBreaking(scratch, "a.pvm", "PVM2\n10 9 4\n1 1 1\n1\n" + wave(360));
  survivesBreaking(scratch, "a.pvm",
                   "DDS v3e\n" + DdsWriter().pack("PVM2\n10 9 4\n1 1 1\n1\n" + wave(360), 1, 10, std::size_t{1} << 24));
}

}  // namespace
}  // namespace blockwalk::volume_test
