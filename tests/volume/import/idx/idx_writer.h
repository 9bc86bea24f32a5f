// SPDX-License-Identifier: Apache-2.0
// IDX volumes as they are written, from the description of the format: another way round than the program goes.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/volume/import/import_scratch.h"
#include "volume/import/idx/idx_bits.h"

namespace blockwalk {

struct IdxWriter {
  std::string bits = "V";  // highest first
  glm::ivec3 first{0};
  glm::ivec3 dims{1};
  int block_bits = 4;
  int blocks_per_file = 3;
  std::size_t width = 1;  // of a voxel in one field
  std::vector<std::string> fields = {"density uint8"};
  std::string more = {};  // of the header
  std::string file_template = "./v/%02x.bin";
  std::set<std::uint64_t> missing = {};
  // By field, z, y, x: of the box alone.
  std::vector<std::string> voxels = {};

  int count() const { return static_cast<int>(bits.size()) - 1; }
  std::uint64_t blocks() const { return std::uint64_t{1} << (count() - block_bits); }

  glm::ivec3 position(std::uint64_t address) const {
    std::uint64_t code = address << 1 | 1;
    while (code >> count() == 0) code <<= 1;
    glm::ivec3 p{0};
    glm::ivec3 bit{1};
    for (int i = 0; i < count(); ++i) {
      const int axis = bits[bits.size() - 1 - static_cast<std::size_t>(i)] - '0';
      if ((code >> i & 1) != 0) p[axis] += bit[axis];
      bit[axis] *= 2;
    }
    return p;
  }

  std::string sample(std::size_t field, glm::ivec3 p) const {
    const glm::ivec3 q = p - first;
    if (glm::any(glm::lessThan(q, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(q, dims))) {
      return std::string(width, '?');  // outside of the box is anything
    }
    const auto at = static_cast<std::size_t>(q.x + dims.x * (q.y + dims.y * q.z));
    return voxels[field].substr(at * width, width);
  }

  // Rows of a lattice are what its places are when sorted.
  std::string block(std::size_t field, std::uint64_t number, bool row_major) const {
    std::vector<glm::ivec3> places;
    for (std::uint64_t i = 0; i >> block_bits == 0; ++i) places.push_back(position((number << block_bits) + i));
    if (row_major) {
      std::ranges::sort(places, [](const glm::ivec3& a, const glm::ivec3& b) {
        return std::tuple(a.z, a.y, a.x) < std::tuple(b.z, b.y, b.x);
      });
    }
    std::string samples;
    for (const glm::ivec3& p : places) samples += sample(field, p);
    return samples;
  }

  std::string header() const {
    std::string text = "(version)\n6  # the one that is\n\n# a comment\n(box)\n";
    for (int i = 0; i < 3; ++i) text += fmt::format("{} {} ", first[i], first[i] + dims[i] - 1);
    text += "0 0 0 0\n(fields)\n";
    for (std::size_t i = 0; i < fields.size(); ++i) text += (i > 0 ? "+ " : "") + fields[i] + "\n";
    return text + fmt::format(
                      "(bits)\n{}\n(bitsperblock)\n{}\n(blocksperfile)\n{}\n(interleave block)\n0\n"
                      "(filename_template)\n{}\n{}",
                      bits, block_bits, blocks_per_file, file_template, more);
  }
};

inline std::string bigEndian(std::uint32_t word) { return swapped(bytesOf<std::uint32_t>({word}), 4); }

// One sequence of LZ4: nothing but the bytes themselves.
inline std::string lz4Literals(const std::string& bytes) {
  std::string packed(1, static_cast<char>(std::min<std::size_t>(15, bytes.size()) << 4));
  if (bytes.size() >= 15) {
    std::size_t left = bytes.size() - 15;
    for (; left >= 255; left -= 255) packed += '\xff';
    packed += static_cast<char>(left);
  }
  return packed + bytes;
}

// How a block is packed: 0, 3 and 7, with 16 for rows.
inline std::string packedAs(const std::string& block, std::uint32_t flags) {
  switch (flags & 0xf) {
    case 3:
      return gzipped(block, MAX_WBITS);
    case 7:
      return lz4Literals(block);
    default:
      return block;
  }
}

inline std::string filesOf(const IdxWriter& writer, std::uint64_t first, const std::vector<std::uint32_t>& flags) {
  const auto per_file = static_cast<std::uint64_t>(writer.blocks_per_file);
  std::string headers(40, '\0');
  std::string data;
  const std::size_t begin = 40 * (1 + writer.fields.size() * per_file);
  for (std::size_t field = 0; field < writer.fields.size(); ++field) {
    for (std::uint64_t number = first; number < first + per_file; ++number) {
      if (number >= writer.blocks() || writer.missing.contains(number)) {
        headers += std::string(40, '\0');
        continue;
      }
      const std::uint32_t how = flags[number % flags.size()];
      const std::string packed = packedAs(writer.block(field, number, (how & 16) != 0), how);
      headers += std::string(8, '\7') + bigEndian(static_cast<std::uint32_t>(begin + data.size())) + bigEndian(0) +
                 bigEndian(static_cast<std::uint32_t>(packed.size())) + bigEndian(how) + std::string(16, '\0');
      data += packed;
    }
  }
  return headers + data;
}

// Writes all, with a way of packing a block after the other.
inline std::filesystem::path writeIdx(const Scratch& scratch, const IdxWriter& writer, const std::string& folder,
                                      const std::vector<std::uint32_t>& flags) {
  const auto per_file = static_cast<std::uint64_t>(writer.blocks_per_file);
  for (std::uint64_t first = 0; first < writer.blocks(); first += per_file) {
    scratch.write(folder + fmt::format("{:02x}.bin", first), filesOf(writer, first, flags));
  }
  return scratch.write("v.idx", writer.header());
}

}  // namespace blockwalk
