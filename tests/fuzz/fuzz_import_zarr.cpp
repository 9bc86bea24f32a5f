// SPDX-License-Identifier: Apache-2.0
// Zarr: an input that begins like JSON is the metadata of an array beside good chunks and a good shard; any other is a
// zip file of a whole hierarchy, and the chunk of arrays with each way of packing. Opened, and read to the end or to a
// bound.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/fuzz/read_source.h"
#include "tests/fuzz/scratch_files.h"
#include "tests/fuzz/target.h"

namespace {

const char* const kVersion2 =
    R"({"zarr_format":2,"shape":[4,4,6],"chunks":[2,4,4],"dtype":"<u2","order":"C","filters":null,"fill_value":0,)"
    R"("compressor":{"id":"zlib"},"dimension_separator":"."})";
const char* const kVersion3 =
    R"({"zarr_format":3,"node_type":"array","shape":[2,2,2],"data_type":"uint8","fill_value":7,"chunk_grid":)"
    R"({"name":"regular","configuration":{"chunk_shape":[2,2,2]}},"chunk_key_encoding":{"name":"default",)"
    R"("configuration":{"separator":"."}},"codecs":[{"name":"sharding_indexed","configuration":{"chunk_shape":[1,2,2],)"
    R"("codecs":[{"name":"transpose","configuration":{"order":[2,0,1]}},{"name":"bytes","configuration":)"
    R"({"endian":"little"}}],"index_codecs":[{"name":"bytes","configuration":{"endian":"little"}}],)"
    R"("index_location":"end"}}],"attributes":{"_ARRAY_DIMENSIONS":["z","y","x"]}})";
const char* const kImage =
    R"({"zarr_format":3,"node_type":"group","attributes":{"ome":{"version":"0.5","multiscales":[{"axes":)"
    R"([{"name":"c","type":"channel"},{"name":"y","type":"space","unit":"micrometer"},{"name":"x","type":"space",)"
    R"("unit":"nanometer"}],"datasets":[{"path":"0","coordinateTransformations":[{"type":"scale","scale":[1,2,3]},)"
    R"({"type":"translation","translation":[0,1,2]}]}]}],"image-label":{"colors":[{"label-value":1,"rgba":[1,2,3,4]}],)"
    R"("properties":[{"label-value":1,"name":"a"}]},"omero":{"channels":[{"label":"a","color":"ff0000","window":)"
    R"({"start":0,"end":9}}]}}}})";

std::string stored(const std::string& name, const std::string& bytes, std::string& directory, std::size_t offset) {
  const auto number = [](std::size_t value) {
    return std::string{static_cast<char>(value), static_cast<char>(value >> 8), 0, 0};
  };
  const std::string common = std::string("\x14\0\0\0\0\0\0\0\0\0\0\0\0\0", 14) + number(bytes.size()) +
                             number(bytes.size()) + number(name.size());
  directory += std::string("PK\1\2\x14\0", 6) + common + std::string(10, '\0') + number(offset) + name;
  return "PK\3\4" + common + name + bytes;
}

std::string zipFile() {
  std::string directory;
  std::string data;
  data += stored("zarr.json", kImage, directory, data.size());
  data += stored("0/zarr.json", kVersion3, directory, data.size());
  data += stored("0/c.0.0.0", std::string(40, '\1'), directory, data.size());
  const auto number = [](std::size_t value) {
    return std::string{static_cast<char>(value), static_cast<char>(value >> 8), 0, 0};
  };
  return data + directory + std::string("PK\5\6\0\0\0\0\3\0\3\0", 12) + number(directory.size()) + number(data.size()) +
         std::string(2, '\0');
}

std::string shard() {
  std::string index(32, '\0');
  index[8] = 4;
  index[16] = 4;
  index[24] = 4;
  return "abcdefgh" + index;
}

std::string withCodec(const std::string& codec) {
  std::string text = kVersion2;
  return text.replace(text.find("zlib"), 4, codec);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const blockwalk::ScratchFiles folder;
  static const std::string place = std::filesystem::path(folder.write("here", "")).parent_path();
  const std::string input(reinterpret_cast<const char*>(data), size);
  blockwalk::ImportOptions options;
  options.memory_bytes = std::uint64_t{1} << 20;
  if (input.starts_with('{')) {
    std::filesystem::remove(place + "/zarr.json");
    folder.write("c.0.0.0", shard());
    folder.write(input.find("zarr_format\":3") != std::string::npos ? "zarr.json" : ".zarray", input);
    blockwalk::readSource(place, options);
    std::filesystem::remove(place + "/zarr.json");
    return 0;
  }
  std::filesystem::remove(place + "/zarr.json");
  folder.write("0.0.0", input);
  for (const char* codec : {"zlib", "blosc", "zstd", "lz4", "gzip"}) {
    folder.write(".zarray", withCodec(codec));
    blockwalk::readSource(place, options);
  }
  folder.write("zarr.json", kVersion3);
  folder.write("c.0.0.0", input);
  blockwalk::readSource(place, options);
  std::filesystem::remove(place + "/zarr.json");
  blockwalk::readSource(folder.write("a.zip", input), options);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  return {kVersion2,
          kVersion3,
          kImage,
          zipFile(),
          shard(),
          std::string("\x40\0\0\0\xff\x31", 6) + std::string(64, 'l'),                               // lz4: literals
          std::string("\x02\x01\x02\x02\x40\0\0\0\x40\0\0\0\x50\0\0\0", 16) + std::string(64, 'b'),  // blosc: a copy
          std::string("\x28\xb5\x2f\xfd\x20\x40\x01\x02\0", 9) + std::string(64, 'z'),               // zstd: raw
          std::string("\x78\x01\x01\x40\0\xbf\xff", 7) + std::string(64, 'd')};                      // zlib: stored
}
