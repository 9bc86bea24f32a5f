// SPDX-License-Identifier: Apache-2.0
// Stores of Zarr arrays as the specifications have them: another way round than the program goes.
#pragma once

#include <blosc.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <lz4.h>
#include <zstd.h>

#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {

using Sizes = std::vector<std::size_t>;

inline std::size_t cells(const Sizes& sizes) {
  return std::accumulate(sizes.begin(), sizes.end(), std::size_t{1}, std::multiplies<>());
}

// Calls visit(place) for every place of a lattice, the axes in `order` from the one that changes last.
inline void forEachPlace(const Sizes& sizes, const Sizes& order, const std::function<void(const Sizes&)>& visit) {
  Sizes place(sizes.size());
  for (std::size_t i = 0; i < cells(sizes); ++i) {
    std::size_t left = i;
    for (std::size_t k = order.size(); k-- > 0; left /= sizes[order[k]]) place[order[k]] = left % sizes[order[k]];
    visit(place);
  }
}

// CRC-32C bit by bit, little endian.
inline std::string checksum(const std::string& bytes) {
  std::uint32_t crc = ~0u;
  for (const char byte : bytes) {
    crc ^= static_cast<std::uint8_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? crc >> 1 ^ 0x82f63b78u : crc >> 1;
  }
  return bytesOf<std::uint32_t>({~crc});
}

// Packs as the codec of that name does; "blosc/lz4" is blosc with lz4 inside.
inline std::string packed(const std::string& codec, const std::string& bytes, std::size_t width = 1) {
  std::string out(bytes.size() * 2 + 1024, '\0');
  std::size_t got = 0;
  if (codec == "zlib") return gzipped(bytes, MAX_WBITS);
  if (codec == "gzip") return gzipped(bytes);
  if (codec == "crc32c") return bytes + checksum(bytes);
  if (codec == "zstd") {
    got = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3);
  } else if (codec == "lz4") {
    return bytesOf<std::uint32_t>({static_cast<std::uint32_t>(bytes.size())}) +
           out.substr(0, static_cast<std::size_t>(LZ4_compress_default(
                             bytes.data(), out.data(), static_cast<int>(bytes.size()), static_cast<int>(out.size()))));
  } else if (codec.starts_with("blosc")) {
    got = static_cast<std::size_t>(blosc_compress_ctx(5, BLOSC_BITSHUFFLE, width, bytes.size(), bytes.data(),
                                                      out.data(), out.size(), codec.substr(6).c_str(), 0, 1));
  } else {
    return bytes;
  }
  out.resize(got);
  return out;
}

struct ZarrWriter {
  Sizes shape;
  Sizes chunks;
  std::size_t width = 1;
  std::string samples = {};          // in C order, in the byte order of the file
  std::string codec = {};            // of version 2, or the last of version 3; empty: none
  std::string dtype = "|u1";         // version 3: "uint8"
  std::string fill = "0";            // as JSON
  std::string fill_sample = {'\0'};  // in the byte order of the file; chunks of nothing else are left out
  Sizes order = {};                  // of axes in a chunk; empty: C
  std::string more = {};             // fields of the metadata

  Sizes inOrder() const {
    Sizes natural(shape.size());
    std::iota(natural.begin(), natural.end(), std::size_t{0});
    return natural;
  }
  // The samples of the chunk at these numbers; nothing where all are the fill value.
  std::optional<std::string> chunk(const Sizes& numbers, const Sizes& size) const {
    std::string bytes;
    bool is_all_fill = true;
    forEachPlace(size, order.empty() ? inOrder() : order, [&](const Sizes& place) {
      std::size_t at = 0;
      bool is_inside = true;
      for (std::size_t axis = 0; axis < shape.size(); ++axis) {
        const std::size_t index = numbers[axis] * size[axis] + place[axis];
        is_inside = is_inside && index < shape[axis];
        at = at * shape[axis] + index;
      }
      const std::string sample = is_inside ? samples.substr(at * width, width) : fill_sample;
      is_all_fill = is_all_fill && sample == fill_sample;
      bytes += sample;
    });
    if (is_all_fill) return std::nullopt;
    return bytes;
  }

  Sizes gridOf(const Sizes& size) const {
    Sizes grid;
    for (std::size_t axis = 0; axis < shape.size(); ++axis) grid.push_back((shape[axis] + size[axis] - 1) / size[axis]);
    return grid;
  }

  std::string compressor() const {
    if (codec.empty()) return "null";
    return fmt::format(R"({{"id":"{}"}})", codec.substr(0, codec.find('/')));
  }

  std::filesystem::path version2(const Scratch& scratch, const std::string& name, char separator = '.') const {
    const bool is_c = order.empty();
    scratch.write(
        name + "/.zarray",
        fmt::format(R"({{"zarr_format":2,"shape":[{}],"chunks":[{}],"dtype":"{}","order":"{}","filters":null,)"
                    R"("fill_value":{},"compressor":{},"dimension_separator":"{}"{}}})",
                    fmt::join(shape, ","), fmt::join(chunks, ","), dtype, is_c ? 'C' : 'F', fill, compressor(),
                    separator, more));
    forEachPlace(gridOf(chunks), inOrder(), [&](const Sizes& numbers) {
      const auto bytes = chunk(numbers, chunks);
      const std::string key = fmt::format("{}", fmt::join(numbers, std::string(1, separator)));
      if (bytes) scratch.write(name + "/" + key, packed(codec, *bytes, width));
    });
    return scratch.path(name);
  }

  // `per_shard`: chunks of a shard along each axis; none: no shards.
  std::filesystem::path version3(const Scratch& scratch, const std::string& name, const std::string& endian = "little",
                                 const Sizes& per_shard = {}, bool index_at_start = false) const {
    std::string codecs = fmt::format(R"({{"name":"transpose","configuration":{{"order":[{}]}}}},)",
                                     fmt::join(order.empty() ? inOrder() : order, ",")) +
                         fmt::format(R"({{"name":"bytes","configuration":{{"endian":"{}"}}}})", endian);
    if (!codec.empty()) codecs += fmt::format(R"(,{{"name":"{}"}})", codec.substr(0, codec.find('/')));
    Sizes object = chunks;
    for (std::size_t axis = 0; axis < per_shard.size(); ++axis) object[axis] *= per_shard[axis];
    if (!per_shard.empty()) {
      codecs = fmt::format(R"({{"name":"sharding_indexed","configuration":{{"chunk_shape":[{}],"codecs":[{}],)"
                           R"("index_location":"{}","index_codecs":[{{"name":"bytes","configuration":)"
                           R"({{"endian":"little"}}}},{{"name":"crc32c"}}]}}}})",
                           fmt::join(chunks, ","), codecs, index_at_start ? "start" : "end");
    }
    scratch.write(name + "/zarr.json",
                  fmt::format(R"({{"zarr_format":3,"node_type":"array","shape":[{}],"data_type":"{}","fill_value":{},)"
                              R"("chunk_grid":{{"name":"regular","configuration":{{"chunk_shape":[{}]}}}},)"
                              R"("chunk_key_encoding":{{"name":"default"}},"codecs":[{}]{}}})",
                              fmt::join(shape, ","), dtype, fill, fmt::join(object, ","), codecs, more));
    forEachPlace(gridOf(object), inOrder(), [&](const Sizes& numbers) {
      const std::string key = fmt::format("{}/c/{}", name, fmt::join(numbers, "/"));
      if (per_shard.empty()) {
        if (const auto bytes = chunk(numbers, chunks)) scratch.write(key, packed(codec, *bytes, width));
      } else if (const std::string bytes = shard(numbers, per_shard, index_at_start); !bytes.empty()) {
        scratch.write(key, bytes);
      }
    });
    return scratch.path(name);
  }

  std::string shard(const Sizes& numbers, const Sizes& per_shard, bool index_at_start) const {
    std::string data;
    std::vector<std::uint64_t> index;
    const std::size_t begin = index_at_start ? cells(per_shard) * 16 + 4 : 0;
    forEachPlace(per_shard, inOrder(), [&](const Sizes& place) {
      Sizes of_chunk;
      for (std::size_t axis = 0; axis < shape.size(); ++axis) {
        of_chunk.push_back(numbers[axis] * per_shard[axis] + place[axis]);
      }
      const auto bytes = chunk(of_chunk, chunks);
      const std::string one = bytes ? packed(codec, *bytes, width) : std::string();
      index.push_back(bytes ? begin + data.size() : UINT64_MAX);
      index.push_back(bytes ? one.size() : UINT64_MAX);
      data += one;
    });
    if (data.empty()) return {};
    const std::string entries = bytesOf(index) + checksum(bytesOf(index));
    return index_at_start ? entries + data : data + entries;
  }
};

// Files of a folder as a zip file has them, stored or deflated.
inline std::string zipped(const std::filesystem::path& folder, bool deflates, const std::string& prefix = {}) {
  std::string data;
  std::string directory;
  std::uint16_t count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(file), {});
    const std::string name = prefix + entry.path().lexically_relative(folder).string();
    const std::string body = deflates ? gzipped(bytes, -MAX_WBITS) : bytes;
    const auto offset = static_cast<std::uint32_t>(data.size());
    const std::string common =
        bytesOf<std::uint16_t>({20, 0, static_cast<std::uint16_t>(deflates ? 8 : 0), 0, 0}) +
        bytesOf<std::uint32_t>({0, static_cast<std::uint32_t>(body.size()), static_cast<std::uint32_t>(bytes.size())}) +
        bytesOf<std::uint16_t>({static_cast<std::uint16_t>(name.size()), 0});
    data.append("PK\3\4").append(common).append(name).append(body);
    directory.append("PK\1\2").append(bytesOf<std::uint16_t>({20})).append(common).append(10, '\0');
    directory.append(bytesOf<std::uint32_t>({offset})).append(name);
    ++count;
  }
  const std::string sizes =
      bytesOf<std::uint32_t>({static_cast<std::uint32_t>(directory.size()), static_cast<std::uint32_t>(data.size())});
  data.append(directory).append("PK\5\6").append(bytesOf<std::uint16_t>({0, 0, count, count}));
  return data.append(sizes).append(2, '\0');
}

}  // namespace blockwalk
