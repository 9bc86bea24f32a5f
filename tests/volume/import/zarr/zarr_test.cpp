// SPDX-License-Identifier: Apache-2.0
// Zarr arrays of both versions: types, orders, codecs, shards, chunks that are not there, zip files, broken ones.
#include <glm/glm.hpp>
#include <random>
#include <thread>

#include "tests/volume/import/zarr/zarr_writer.h"
#include "volume/voxel_box.h"

namespace blockwalk::volume_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Values that a byte holds, with fill in most of the chunks.
std::string sparseBytes(std::size_t count) {
  std::string bytes(count, '\0');
  for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<char>(i % 7 == 0 ? i * 31 : 0);
  return bytes;
}

template <typename T>
std::string samplesOf(const std::string& bytes, bool swap) {
  std::vector<T> values;
  for (const char byte : bytes) values.push_back(static_cast<T>(static_cast<signed char>(byte)));
  return swap ? swapped(bytesOf(values), sizeof(T)) : bytesOf(values);
}

// What the source holds, as floats.
std::vector<float> valuesOf(Source& source) {
  const std::string all = readAll(source);
  const std::size_t width = voxelBytes(source.info().type);
  std::vector<float> values;
  for (std::size_t at = 0; at < all.size(); at += width) {
    const float stored = storedDensity(source.info().type, reinterpret_cast<const std::byte*>(&all[at]));
    values.push_back(stored + static_cast<float>(source.info().channels[0].value_offset));
  }
  return values;
}

template <typename T>
void readsAs(const std::string& dtype, const std::string& name) {
  const std::string bytes = sparseBytes(5 * 6 * 7);
  std::vector<float> wanted;
  for (const char byte : bytes) wanted.push_back(static_cast<float>(static_cast<T>(static_cast<signed char>(byte))));
  for (const bool swap : {false, true}) {
    const Scratch scratch;
    ZarrWriter writer{
        .shape = {5, 6, 7}, .chunks = {2, 6, 3}, .width = sizeof(T), .samples = samplesOf<T>(bytes, swap)};
    writer.fill_sample = std::string(sizeof(T), '\0');
    writer.dtype = (sizeof(T) == 1 ? "|" : swap ? ">" : "<") + dtype;
    EXPECT_EQ(valuesOf(*openSource({writer.version2(scratch, "a")}, {})), wanted) << writer.dtype;
    writer.order = {2, 1, 0};
    EXPECT_EQ(valuesOf(*openSource({writer.version2(scratch, "f", '/')}, {})), wanted) << writer.dtype;
    writer.dtype = name;
    writer.order = {1, 2, 0};
    const std::string endian = swap ? "big" : "little";
    EXPECT_EQ(valuesOf(*openSource({writer.version3(scratch, "b", endian)}, {})), wanted) << name;
    EXPECT_EQ(valuesOf(*openSource({writer.version3(scratch, "c", endian, {2, 1, 3})}, {})), wanted) << name;
  }
}

TEST(Zarr, ReadsEveryTypeInBothByteOrders) {
  readsAs<std::uint8_t>("u1", "uint8");
  readsAs<std::int8_t>("i1", "int8");
  readsAs<std::uint16_t>("u2", "uint16");
  readsAs<std::int16_t>("i2", "int16");
  readsAs<std::uint32_t>("u4", "uint32");
  readsAs<std::int32_t>("i4", "int32");
  readsAs<std::uint64_t>("u8", "uint64");
  readsAs<std::int64_t>("i8", "int64");
  readsAs<float>("f4", "float32");
  readsAs<double>("f8", "float64");
}

TEST(Zarr, ReadsHalvesAndTruths) {
  const Scratch scratch;
  ZarrWriter writer{.shape = {1, 1, 6}, .chunks = {1, 1, 6}, .width = 2};
  // 1, -2, the greatest, the least above 0, -0 and 1/3
  writer.samples = bytesOf<std::uint16_t>({0x3c00, 0xc000, 0x7bff, 0x0001, 0x8000, 0x3555});
  writer.dtype = "<f2";
  writer.fill_sample = std::string(2, '\0');
  EXPECT_THAT(valuesOf(*openSource({writer.version2(scratch, "h")}, {})),
              ElementsAre(1.0f, -2.0f, 65504.0f, 0x1p-24f, -0.0f, 0.333251953125f));
  writer.samples = swapped(writer.samples, 2);
  writer.dtype = "float16";
  writer.fill = "\"0x3c00\"";
  EXPECT_THAT(valuesOf(*openSource({writer.version3(scratch, "h3", "big")}, {})),
              ElementsAre(1.0f, -2.0f, 65504.0f, 0x1p-24f, -0.0f, 0.333251953125f));
  ZarrWriter truths{.shape = {4}, .chunks = {3}, .samples = std::string("\1\0\0\1", 4), .dtype = "|b1", .fill = "true"};
  truths.fill_sample = "\1";
  EXPECT_THAT(valuesOf(*openSource({truths.version2(scratch, "t")}, {})), ElementsAre(1.0f, 0.0f, 0.0f, 1.0f));
}

TEST(Zarr, UnpacksEveryCodec) {
  const std::string samples = sparseBytes(2 * 9 * 10 * 11);
  for (const std::string codec :
       {"zlib", "gzip", "zstd", "lz4", "blosc/lz4", "blosc/lz4hc", "blosc/zstd", "blosc/zlib", "blosc/blosclz"}) {
    const Scratch scratch;
    ZarrWriter writer{.shape = {9, 10, 11}, .chunks = {4, 5, 6}, .width = 2, .samples = samples, .codec = codec};
    writer.dtype = "<u2";
    writer.fill_sample = std::string(2, '\0');
    EXPECT_EQ(importAll(writer.version2(scratch, "a")), samples) << codec;
    writer.dtype = "uint16";
    EXPECT_EQ(importAll(writer.version3(scratch, "b")), samples) << codec;
    EXPECT_EQ(importAll(writer.version3(scratch, "c", "little", {1, 2, 2}, true)), samples) << codec;
    for (const bool deflates : {false, true}) {
      EXPECT_EQ(importAll(scratch.write("c.zip", zipped(scratch.path("c"), deflates))), samples) << codec;
      EXPECT_EQ(importAll(scratch.write("top.zip", zipped(scratch.path("a"), deflates, "a.zarr/"))), samples) << codec;
    }
  }
}

// One voxel in a corner, and one far off.
ZarrWriter nearlyEmpty() {
  ZarrWriter writer{
      .shape = {40, 40, 40}, .chunks = {8, 8, 8}, .samples = std::string(std::size_t{40} * 40 * 40, '\3')};
  writer.samples[0] = 'a';
  writer.samples[(35 * 40 + 20) * 40 + 17] = 'b';
  writer.fill = "3";
  writer.fill_sample = "\3";
  return writer;
}

void isBlankWhereNothingIs(Source& source, int width) {
  EXPECT_THAT(source.info().blank, ElementsAre(std::byte{3}));
  std::vector<VoxelRun> runs;
  source.findRuns({.begin = {0, 0, 0}, .end = {40, 8, 8}}, runs);
  EXPECT_THAT(runs, ElementsAre(VoxelRun{.begin = 0, .end = width}));
  source.findRuns({.begin = {3, 16, 32}, .end = {20, 24, 40}}, runs);
  EXPECT_THAT(runs, ElementsAre(VoxelRun{.begin = 16, .end = 20}));
  source.findRuns({.begin = {0, 0, 8}, .end = {40, 40, 32}}, runs);
  EXPECT_THAT(runs, IsEmpty());
  source.findRuns({.begin = {24, 0, 0}, .end = {40, 40, 40}}, runs);
  EXPECT_THAT(runs, IsEmpty());
}

TEST(Zarr, ChunksThatAreNotThereAreBlank) {
  const Scratch scratch;
  ZarrWriter writer = nearlyEmpty();
  for (const char separator : {'.', '/'}) {
    const auto source =
        openSource({writer.version2(scratch, std::string("a") + (separator == '.' ? "1" : "2"), separator)}, {});
    isBlankWhereNothingIs(*source, 8);
    EXPECT_EQ(readAll(*source), writer.samples);
  }
  writer.dtype = "uint8";
  const auto source = openSource({writer.version3(scratch, "b", "little", {2, 5, 1})}, {});
  isBlankWhereNothingIs(*source, 8);
  EXPECT_EQ(readAll(*source), writer.samples);
}

// A box with more chunks than are looked at one by one.
TEST(Zarr, LargeBoxesAreBlankWhereNoObjectIs) {
  const Scratch scratch;
  ZarrWriter writer{
      .shape = {60, 60, 60}, .chunks = {2, 2, 2}, .samples = std::string(std::size_t{60} * 60 * 60, '\0')};
  writer.samples[(5 * 60 + 40) * 60 + 50] = 'a';
  const auto source = openSource({writer.version2(scratch, "a")}, {});
  const auto isBlank = [&](glm::ivec3 begin, glm::ivec3 end) {
    std::vector<VoxelRun> runs;
    source->findRuns({.begin = begin, .end = end}, runs);
    return runs.empty();
  };
  EXPECT_FALSE(isBlank({0, 0, 0}, {60, 60, 60}));
  EXPECT_TRUE(isBlank({0, 0, 6}, {60, 60, 60}));
  EXPECT_TRUE(isBlank({0, 42, 0}, {60, 60, 60}));
  EXPECT_TRUE(isBlank({0, 0, 0}, {60, 40, 60}));
  EXPECT_TRUE(isBlank({0, 0, 0}, {50, 60, 60}));
  EXPECT_TRUE(isBlank({52, 0, 0}, {60, 60, 60}));
  EXPECT_FALSE(isBlank({20, 0, 0}, {52, 60, 60}));
}

TEST(Zarr, BoxesAndOtherSourcesGiveTheSameVoxels) {
  const Scratch scratch;
  ZarrWriter writer{.shape = {20, 30, 40}, .chunks = {7, 8, 9}, .samples = sparseBytes(std::size_t{20} * 30 * 40)};
  const auto first = openSource({writer.version2(scratch, "a")}, {});
  const auto other = first->another()->another();
  const VoxelBox box{.begin = {5, 3, 2}, .end = {33, 28, 19}};
  std::string wanted;
  for (int z = 2; z < 19; ++z) {
    for (int y = 3; y < 28; ++y) wanted += writer.samples.substr(static_cast<std::size_t>((z * 30 + y) * 40 + 5), 28);
  }
  for (Source* source : {first.get(), other.get()}) {
    std::string got(box.voxels(), '\0');
    source->readBox(box, std::as_writable_bytes(std::span(got)));
    EXPECT_EQ(got, wanted);
  }
}

TEST(Zarr, ThreadsReadTheSameChunks) {
  const Scratch scratch;
  ZarrWriter writer{.shape = {16, 32, 32}, .chunks = {8, 16, 16}, .samples = sparseBytes(std::size_t{16} * 32 * 32)};
  writer.codec = "zstd";
  const auto path = writer.version2(scratch, "a");
  const auto first = openSource({path}, {});
  const auto readByFour = [](const Source& source) {
    std::vector<std::string> results(4);
    std::vector<std::thread> threads;
    for (std::string& result : results) {
      threads.emplace_back([&result, other = source.another()] {
        try {
          result = readAll(*other, 5);
        } catch (const DataError& error) {
          result = error.what();
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    return results;
  };
  EXPECT_THAT(readByFour(*first), testing::Each(writer.samples));
  // Of a broken chunk all of them hear.
  scratch.write("a/1.1.1", "broken");
  const auto broken = openSource({path}, {});
  EXPECT_THAT(readByFour(*broken), testing::Each(HasSubstr("1.1.1: zstd: 6 bytes do not unpack to 2048")));
}

TEST(Zarr, BrokenMetadataAreRefusedByNameAndBound) {
  const Scratch scratch;
  const auto refusalOf = [&](const std::string& from, const std::string& to) {
    const ZarrWriter writer{.shape = {4, 4, 4}, .chunks = {2, 2, 2}, .samples = std::string(64, 'v'), .codec = "zlib"};
    const auto path = writer.version2(scratch, "a");
    std::ifstream file(path / ".zarray");
    std::string text(std::istreambuf_iterator<char>(file), {});
    text.replace(text.find(from), from.size(), to);
    scratch.write("a/.zarray", text);
    return refusal({path});
  };
  EXPECT_THAT(refusalOf(R"("chunks":[2,2,2])", R"("chunks":[2,0,2])"),
              HasSubstr(".zarray: chunks[1] is 0: must be 1.."));
  EXPECT_THAT(refusalOf(R"("chunks":[2,2,2])", R"("chunks":[2,2])"), HasSubstr("chunks must have 3 sizes"));
  EXPECT_THAT(refusalOf(R"("chunks":[2,2,2])", R"("chunks":[9999999,9999999,9999999])"),
              HasSubstr("chunk shape: a chunk has more than 536870912 bytes"));
  EXPECT_THAT(refusalOf("[4,4,4]", "[4,4,-1]"), HasSubstr("shape[2] is -1: must be 1.."));
  EXPECT_THAT(refusalOf("[4,4,4]", "[4,4,70000]"), HasSubstr("shape: 70000 is outside 1..65536"));
  EXPECT_THAT(refusalOf("[4,4,4]", "[1,1,1,1,1,1,1,1,1]"), HasSubstr("must be a list of 1..8 sizes"));
  EXPECT_THAT(refusalOf("|u1", "<c8"), HasSubstr("dtype is \"<c8\": of types"));
  EXPECT_THAT(refusalOf("null,\"fill", R"([{"id":"delta"}],"fill)"),
              HasSubstr("filters[0].id is \"delta\": filters cannot be undone"));
  EXPECT_THAT(refusalOf("\"zlib\"", "\"lzma\""), HasSubstr("compressor.id is \"lzma\": blosc, zstd"));
  EXPECT_THAT(refusalOf("\"fill_value\":0", "\"fill_value\":256"),
              HasSubstr("fill_value is 256: must be a value of the array's type"));
  EXPECT_THAT(refusalOf("\"zarr_format\":2", "\"zarr_format\":4"), HasSubstr("zarr_format is 4: must be 2"));
  std::string many;
  for (int i = 0; i < 1 << 20; ++i) many += "0,";
  EXPECT_THAT(refusalOf("{", "{\"more\":[" + many + "0],"), HasSubstr(".zarray: has more than 1048576 values"));
  EXPECT_THAT(refusalOf("{", std::string(std::size_t{17} << 20, ' ')),
              HasSubstr("metadata must have at most 16777216"));
  EXPECT_THAT(refusalOf("{", std::string(100, '[')), HasSubstr("is nested 101 times, must be at most 64"));
}

TEST(Zarr, ChunksThatUnpackToSomethingElseAreRefused) {
  const Scratch scratch;
  for (const std::string codec : {"", "zlib", "gzip", "zstd", "lz4", "blosc/lz4"}) {
    const ZarrWriter writer{.shape = {4, 4, 4}, .chunks = {4, 4, 4}, .samples = std::string(64, 'v'), .codec = codec};
    const auto path = writer.version2(scratch, "a");
    for (const std::size_t bytes : {63u, 65u, 100000u}) {
      scratch.write("a/0.0.0", packed(codec, std::string(bytes, 'w')));
      EXPECT_THAT(refusal({path}), HasSubstr("0.0.0")) << codec << bytes;
    }
    scratch.write("a/0.0.0", "");
    EXPECT_THAT(refusal({path}), HasSubstr("0.0.0")) << codec;
  }
}

TEST(Zarr, ShardsThatPointElsewhereAreRefused) {
  const Scratch scratch;
  ZarrWriter writer{.shape = {4, 4, 4}, .chunks = {2, 2, 2}, .samples = std::string(64, 'v'), .dtype = "uint8"};
  const auto path = writer.version3(scratch, "a", "little", {2, 2, 2});
  std::string shard = writer.shard({0, 0, 0}, {2, 2, 2}, false);
  const std::string index = shard.substr(64, 128);
  const auto with = [&](std::vector<std::uint64_t> entry) {
    const std::string other = bytesOf(entry) + index.substr(16);
    scratch.write("a/c/0/0/0", shard.substr(0, 64) + other + checksum(other));
    return refusal({path});
  };
  EXPECT_THAT(with({196, 8}), HasSubstr("chunk 0,0,0: 8 bytes from byte 196 are declared, the shard has 196"));
  EXPECT_THAT(with({UINT64_MAX - 3, 8}), HasSubstr("are declared"));
  EXPECT_THAT(with({0, 9}), HasSubstr("chunk 0,0,0: has 9 bytes, a chunk has 8"));
  scratch.write("a/c/0/0/0", shard.substr(0, 64) + index + "1234");
  EXPECT_THAT(refusal({path}), HasSubstr("crc32c: the checksum of 128 bytes is another"));
  scratch.write("a/c/0/0/0", "short");
  EXPECT_THAT(refusal({path}), HasSubstr("has 5 bytes, the index of a shard has 132"));
}

// What a file says after a change of it: a refusal, or voxels.
std::optional<std::string> readOrRefused(const std::filesystem::path& path) {
  try {
    return importAll(path);
  } catch (const DataError&) {
    return std::nullopt;
  }
}

TEST(Zarr, NoTruncationAndNoFlippedBitGivesOtherVoxels) {
  const Scratch scratch;
  ZarrWriter writer{.shape = {6, 8, 8}, .chunks = {3, 4, 8}, .samples = sparseBytes(6 * 8 * 8), .codec = "crc32c"};
  writer.dtype = "uint8";
  const auto path = writer.version3(scratch, "a", "little", {2, 2, 1});
  const std::string shard = writer.shard({0, 0, 0}, {2, 2, 1}, false);
  for (std::size_t part = 0; part < 64; ++part) {
    scratch.write("a/c/0/0/0", shard.substr(0, shard.size() * part / 64));
    EXPECT_EQ(readOrRefused(path), std::nullopt) << part;
  }
  std::mt19937 random(7);
  for (int flip = 0; flip < 1000; ++flip) {
    std::string other = shard;
    other[random() % other.size()] ^= static_cast<char>(1 << random() % 8);
    scratch.write("a/c/0/0/0", other);
    EXPECT_EQ(readOrRefused(path).value_or(writer.samples), writer.samples) << flip;
  }
  scratch.write("a/c/0/0/0", shard);
  std::ifstream file(path / "zarr.json");
  const std::string text(std::istreambuf_iterator<char>(file), {});
  for (std::size_t part = 0; part < 64; ++part) {
    scratch.write("a/zarr.json", text.substr(0, text.size() * part / 64));
    EXPECT_EQ(readOrRefused(path), std::nullopt) << part;
  }
  scratch.write("a/zarr.json", text);
  const std::string zip = zipped(path, true);
  for (std::size_t part = 0; part < 64; ++part) {
    EXPECT_EQ(readOrRefused(scratch.write("a.zip", zip.substr(0, zip.size() * part / 64))), std::nullopt) << part;
  }
  for (int flip = 0; flip < 1000; ++flip) {
    std::string other = zip;
    other[random() % other.size()] ^= static_cast<char>(1 << random() % 8);
    readOrRefused(scratch.write("a.zip", other));  // metadata may mean another array
  }
}

}  // namespace
}  // namespace blockwalk::volume_test
