// SPDX-License-Identifier: Apache-2.0
// Each filter: packed by its own library, or the way its format is written down; and what is broken of it.
#include "volume/import/hdf5/hdf5_filters.h"

#include <bzlib.h>

#include "tests/volume/import/zarr/zarr_writer.h"

#ifdef BLOCKWALK_HDF5
#include "tests/volume/import/hdf5/hdf5_writer.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

const Extent kPackedShape = {6, 7, 10};
const Extent kPackedChunk = {3, 7, 5};

std::string bigEndian(std::uint64_t value, std::size_t width) {
  std::string bytes;
  for (std::size_t i = width; i-- > 0;) bytes += static_cast<char>(value >> 8 * i);
  return bytes;
}

std::string bzipped(const std::string& bytes) {
  std::string out(bytes.size() + 1024, '\0');
  auto got = static_cast<unsigned>(out.size());
  std::string in = bytes;
  BZ2_bzBuffToBuffCompress(out.data(), &got, in.data(), static_cast<unsigned>(in.size()), 1, 0, 0);
  out.resize(got);
  return out;
}

// Without the length that packed() puts in front.
std::string lz4Block(const std::string& bytes) { return packed("lz4", bytes).substr(4); }

std::string lz4Blocks(const std::string& bytes, std::size_t block) {
  std::string out = bigEndian(bytes.size(), 8) + bigEndian(block, 4);
  for (std::size_t at = 0; at < bytes.size(); at += block) {
    const std::string piece = bytes.substr(at, block);
    const std::string small = lz4Block(piece);
    const std::string& stored = small.size() < piece.size() ? small : piece;
    out += bigEndian(stored.size(), 4) + stored;
  }
  return out;
}

// Bit by bit, as Masui et al. 2015 have it.
std::string bitShuffled(const std::string& bytes, std::size_t width) {
  const std::size_t count = bytes.size() / width;
  std::string out(bytes.size(), '\0');
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t bit = 0; bit < 8 * width; ++bit) {
      const bool is_set = (static_cast<unsigned char>(bytes[i * width + bit / 8]) >> bit % 8 & 1) != 0;
      char& byte = out[bit * (count / 8) + i / 8];
      if (is_set) byte = static_cast<char>(byte | 1 << i % 8);
    }
  }
  return out;
}

std::string bitShuffledBlocks(const std::string& bytes, std::size_t width, std::size_t block,
                              const std::string& codec) {
  std::string out = codec.empty() ? "" : bigEndian(bytes.size(), 8) + bigEndian(block * width, 4);
  const std::size_t count = bytes.size() / width;
  std::size_t done = 0;
  while (count - done >= 8) {
    const std::size_t samples = std::min(block, (count - done) / 8 * 8);
    const std::string rows = bitShuffled(bytes.substr(done * width, samples * width), width);
    const std::string small = codec == "lz4" ? lz4Block(rows) : packed(codec, rows);
    out += codec.empty() ? rows : bigEndian(small.size(), 4) + small;
    done += samples;
  }
  return out + bytes.substr(done * width);
}

struct PackedCase {
  std::string name;
  unsigned id;
  std::vector<unsigned> values;
  std::function<std::string(const std::string&)> pack;
};

std::vector<PackedCase> packedCases() {
  return {{"bzip2", 307, {9}, bzipped},
          {"blosc", 32001, {2, 2, 2}, [](const std::string& bytes) { return packed("blosc/zstd", bytes, 2); }},
          {"lz4", 32004, {64}, [](const std::string& bytes) { return lz4Blocks(bytes, 64); }},
          {"lz4", 32004, {}, [](const std::string& bytes) { return lz4Blocks(bytes, 1 << 20); }},
          {"zstd", 32015, {3}, [](const std::string& bytes) { return packed("zstd", bytes); }},
          {"bitshuffle",
           32008,
           {0, 3, 2, 16, 0},
           [](const std::string& bytes) { return bitShuffledBlocks(bytes, 2, 16, ""); }},
          {"bitshuffle",
           32008,
           {0, 3, 2, 16, 2},
           [](const std::string& bytes) { return bitShuffledBlocks(bytes, 2, 16, "lz4"); }},
          {"bitshuffle",
           32008,
           {0, 3, 2, 0, 3},
           [](const std::string& bytes) { return bitShuffledBlocks(bytes, 2, 4096, "zstd"); }},
          {"lzf", 32000, {}, [](const std::string& bytes) {
             std::string out;
             for (const char byte : bytes) out += std::string(1, '\0') + byte;
             return out;
           }}};
}

// A file whose chunks went through the filter, `left_out` of them not.
std::filesystem::path writePacked(const Scratch& scratch, const PackedCase& packing, bool leaves_out) {
  Hdf5Writer writer(scratch.path("a.h5"));
  DatasetKind kind{.type = H5T_STD_U16LE, .chunk = kPackedChunk};
  kind.properties = [&](hid_t p) {
    H5Pset_filter(p, static_cast<H5Z_filter_t>(packing.id), H5Z_FLAG_OPTIONAL, packing.values.size(),
                  packing.values.data());
  };
  writer.create("v", kPackedShape, kind, [&](hid_t dataset) {
    for (hsize_t z = 0; z < 6; z += 3) {
      for (hsize_t x = 0; x < 10; x += 5) {
        std::vector<std::uint16_t> chunk;
        for (std::size_t i = 0; i < sampleCount(kPackedChunk); ++i) {
          const std::size_t at = ((z + i / 35) * 7 + i / 5 % 7) * 10 + x + i % 5;
          chunk.push_back(static_cast<std::uint16_t>(at * 3));
        }
        const bool is_left_out = leaves_out && x == 5;
        const std::string bytes = is_left_out ? bytesOf(chunk) : packing.pack(bytesOf(chunk));
        const Extent corner = {z, 0, x};
        H5Dwrite_chunk(dataset, H5P_DEFAULT, is_left_out ? 1 : 0, corner.data(), bytes.size(), bytes.data());
      }
    }
  });
  return writer.close();
}

std::vector<double> packedValues() {
  std::vector<double> values;
  for (std::size_t i = 0; i < sampleCount(kPackedShape); ++i) values.push_back(static_cast<double>(3 * i));
  return values;
}

TEST(Hdf5Filters, OfOthersAreUndone) {
  const Scratch scratch;
  for (const PackedCase& packing : packedCases()) {
    for (const bool leaves_out : {false, true}) {
      EXPECT_EQ(dataValues(*openSource({writePacked(scratch, packing, leaves_out)}, {})), packedValues())
          << packing.name;
    }
  }
}

TEST(Hdf5Filters, OfTheLibraryAreUndone) {
  const Scratch scratch;
  std::vector<int> values;
  for (const double value : packedValues()) values.push_back(static_cast<int>(value));
  const std::vector<std::function<void(hid_t)>> filters = {[](hid_t p) { H5Pset_deflate(p, 9); },
                                                           [](hid_t p) { H5Pset_shuffle(p); },
                                                           [](hid_t p) { H5Pset_fletcher32(p); },
                                                           [](hid_t p) {
                                                             H5Pset_shuffle(p);
                                                             H5Pset_deflate(p, 1);
                                                             H5Pset_fletcher32(p);
                                                           },
                                                           [](hid_t p) {
                                                             H5Pset_fletcher32(p);
                                                             H5Pset_shuffle(p);
                                                             H5Pset_deflate(p, 1);
                                                           },
                                                           [](hid_t p) { H5Pset_szip(p, H5_SZIP_NN_OPTION_MASK, 8); },
                                                           [](hid_t p) { H5Pset_szip(p, H5_SZIP_EC_OPTION_MASK, 16); }};
  for (const bool is_big : {false, true}) {
    for (std::size_t i = 0; i < filters.size(); ++i) {
      if (i >= 5 && !canUndoSzip()) continue;
      Hdf5Writer writer(scratch.path("a.h5"), is_big);
      writer.dataset("v", kPackedShape, values,
                     {.type = is_big ? H5T_STD_U32BE : H5T_STD_U16LE, .chunk = kPackedChunk, .properties = filters[i]});
      EXPECT_EQ(dataValues(*openSource({writer.close()}, {})), packedValues()) << i << is_big;
    }
  }
}

TEST(Hdf5Filters, WhatIsBrokenIsNamed) {
  const Scratch scratch;
  for (PackedCase packing : packedCases()) {
    const auto pack = packing.pack;
    const auto refused = [&](const std::function<std::string(const std::string&)>& breaking) {
      packing.pack = [&](const std::string& bytes) { return breaking(pack(bytes)); };
      return refusal({writePacked(scratch, packing, false)});
    };
    for (const std::size_t cut : {0, 1, 5, 20}) {
      const std::string message =
          refused([&](const std::string& bytes) { return bytes.substr(0, bytes.size() - 1 - cut); });
      EXPECT_THAT(message, HasSubstr("a.h5: 'v': chunk 0,0,")) << packing.name << cut;
      EXPECT_THAT(message, HasSubstr(packing.name));
    }
    EXPECT_THAT(refused([](const std::string& bytes) { return bytes + std::string(5000, 'x'); }),
                HasSubstr("a.h5: 'v': "));
  }
  Hdf5Writer writer(scratch.path("sum.h5"));
  writer.dataset("v", {4, 4, 4}, std::vector<int>(64, 0x55),
                 {.chunk = {4, 4, 4}, .properties = [](hid_t p) { H5Pset_fletcher32(p); }});
  std::ifstream stream(writer.close(), std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  const std::size_t at = bytes.find(std::string(64, 0x55));
  ASSERT_NE(at, std::string::npos);
  bytes[at + 9] = 0x54;
  EXPECT_THAT(refusal({scratch.write("sum.h5", bytes)}), HasSubstr("chunk 0,0,0: fletcher32: "));
}

TEST(Hdf5Filters, OthersAreRefusedByName) {
  const Scratch scratch;
  const auto pack = [](const std::string& bytes) { return bytes; };
  EXPECT_THAT(refusal({writePacked(scratch, {"", 32013, {}, pack}, false)}),
              HasSubstr("a.h5: 'v': its filter zfp cannot be undone"));
  EXPECT_THAT(refusal({writePacked(scratch, {"", 300, {}, pack}, false)}),
              HasSubstr("its filter 300 cannot be undone"));
}

}  // namespace
}  // namespace blockwalk::volume_test
#endif
