// SPDX-License-Identifier: Apache-2.0
// Formats of one file that hold one grid: npy, MRC, .vox, KVX, PVM, Amira, VGI, ISQ, AIM. Opened, and read to the end
// or to a bound.
#include <cstdint>
#include <string>
#include <vector>

#include "tests/fuzz/read_source.h"
#include "tests/fuzz/scratch_files.h"
#include "tests/fuzz/target.h"

namespace {

std::string words(std::initializer_list<std::uint32_t> values) {
  std::string bytes;
  for (const std::uint32_t value : values) {
    for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (8 * i));
  }
  return bytes;
}

// `words` from byte `at` on.
void put(std::string& header, std::size_t at, std::initializer_list<std::uint32_t> values) {
  const std::string bytes = words(values);
  header.replace(at, bytes.size(), bytes);
}

std::string mrc(std::uint32_t mode, std::size_t voxel_bytes) {
  constexpr std::uint32_t kTwo = 0x40000000;  // 2.0f
  std::string header(1024, '\0');
  put(header, 0, {4, 3, 2, mode, 1, 2, 3, 4, 3, 2, kTwo, kTwo, kTwo, 0, 0, 0, 2, 1, 3});
  header.replace(208, 8, std::string("MAP \x44\x44\0\0", 8));
  return header + std::string(24 * voxel_bytes, 'm');
}

std::string npy(const std::string& type, const std::string& shape, std::size_t bytes) {
  std::string text = "{'descr': '" + type + "', 'fortran_order': False, 'shape': " + shape + ", }";
  text += std::string(63 - text.size() % 64, ' ') + "\n";
  return std::string("\x93NUMPY\1\0", 8) + static_cast<char>(text.size()) + '\0' + text + std::string(bytes, 'n');
}

std::string chunk(const std::string& id, const std::string& content) {
  return id + words({static_cast<std::uint32_t>(content.size()), 0}) + content;
}

std::string vox() {
  const std::string dict = words({1, 2}) + "_t" + words({5}) + "1 2 3" + words({});
  const std::string chunks = chunk("SIZE", words({3, 2, 4})) + chunk("XYZI", words({2, 0x05010002, 0x01000000})) +
                             chunk("nTRN", words({0, 0, 1, 0xffffffff, 0, 1}) + dict) +
                             chunk("nGRP", words({1, 0, 1, 2})) + chunk("nSHP", words({2, 0, 1, 0, 0})) +
                             chunk("LAYR", words({0, 0, 0xffffffff}));
  return "VOX " + words({150}) + "MAIN" + words({0, static_cast<std::uint32_t>(chunks.size())}) + chunks;
}

std::string amira(const std::string& kind, const std::string& field, const std::string& data) {
  return "# AmiraMesh " + kind +
         "\ndefine Lattice 4 3 2\nParameters {\n Units { Coordinates \"mm\" }\n Materials { Out { Id 1 } In {\n Color "
         "1 0 0\n"
         "} }\n BoundingBox 0 3 0 2 0 1,\n CoordType \"uniform\"\n}\nLattice { " +
         field + "\n# Data section follows\n@1\n" + data + "\n";
}

std::string isq() {
  std::string header(512, '\0');
  header.replace(0, 16, "CTDATA-HEADER_V1");
  put(header, 44, {4, 3, 2, 40, 30, 20});
  put(header, 88, {4096});
  return header + std::string(48, 'i');
}

std::string aim() {
  std::string header(160, '\0');
  put(header, 0, {20, 140, 17, 48, 0});
  put(header, 40, {0x00020002, 1, 2, 3, 4, 3, 2});
  put(header, 128, {0x00003f80, 0x00003f80, 0x00003f80});
  return header + "Mu_Scaling 4096 \n" + std::string(48, 'a');
}

std::string kvx() {
  // 1 x 1 x 4, one slab of two.
  const std::string body = words({1, 1, 4, 0, 0, 0, 12, 17}) + std::string("\0\0\5\0\1\2\x3f\x10\x20", 9);
  return words({static_cast<std::uint32_t>(body.size())}) + body + std::string(768, '\x20');
}

const char* const kEsrfXml =
    "<tomodb2><reconstruction><listSubVolume><subVolume><SUBVOLUME_NAME>part.vol</SUBVOLUME_NAME><SIZEX>4</"
    "SIZEX><SIZEY>3</SIZEY><SIZEZ>1</SIZEZ></subVolume></listSubVolume></reconstruction></tomodb2>";
const char* const kVgi =
    "{volume1}\n[representation]\nsize = 4 3 2\n[file1]\nFileFormat = raw\nName = part.vol\nDatatype = unsigned "
    "integer\n"
    "BitsPerElement = 16\n[geometry]\nresolution = 1 2 3\nunit = mm\n";

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const blockwalk::ScratchFiles folder;
  static const std::string part = folder.write("part.vol", std::string(48, 'v'));
  blockwalk::ImportOptions options;
  options.memory_bytes = std::uint64_t{1} << 20;
  blockwalk::readSource(folder.write("input", std::string(reinterpret_cast<const char*>(data), size)), options);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  return {npy("<f4", "(2, 3, 4)", 96),
          npy(">u2", "(3, 2, 2, 2)", 48),
          mrc(2, 4),
          mrc(12, 2),
          vox(),
          isq(),
          aim(),
          kVgi,
          "NUM_X = 4\nNUM_Y = 3\nNUM_Z = 1\nvoxelSize = 2\nSUBVOLUME_NAME = part.vol\n",
          kEsrfXml,
          kvx(),
          "PVM2\n4 3 2\n1 2 3\n1\n" + std::string(24, 'p'),
          std::string("DDS v3d\n\0\0\x07\xc7\x8e\x1c\x38\x70", 16),
          amira("BINARY-LITTLE-ENDIAN 2.1", "ushort Data } @1", std::string(48, 's')),
          amira("3D BINARY 2.0", "byte Labels } @1(HxByteRLE,6)",
                std::string("\x15z\x83"
                            "abc",
                            6)),
          amira("ASCII 1.0", "byte Data } = @1", "1 2 3 4 5 6 7 8 9 10 11 12 1 2 3 4 5 6 7 8 9 10 11 12")};
}
