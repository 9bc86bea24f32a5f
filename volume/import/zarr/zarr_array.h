// SPDX-License-Identifier: Apache-2.0
// What an array of Zarr is: its shape, the chunks that it is cut into, and how those lie in objects of the store.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "volume/import/convert/sample.h"
#include "volume/import/zarr/zarr_codec.h"
#include "volume/import/zarr/zarr_node.h"

namespace blockwalk {

// Objects that hold several chunks, and an index of where those lie.
struct ZarrSharding {
  std::vector<ZarrCodec> index_codecs = {};
  bool index_at_start = false;
  std::vector<std::size_t> order = {};  // axes of the index, from the one that changes last
};

// Lists are by axis of the array, as its shape has them.
struct ZarrArray {
  std::string key = {};
  std::string file = {};  // of its metadata, for messages
  std::vector<std::uint64_t> shape = {};
  std::vector<std::uint64_t> object_chunk = {};  // what one object covers
  std::vector<std::uint64_t> chunk = {};         // what is packed by itself; of sharded arrays a part of that
  SampleFormat format = {};
  std::vector<std::byte> fill = {};     // one sample of `format`
  std::vector<std::size_t> order = {};  // axes of a chunk, from the one that changes last
  std::vector<ZarrCodec> codecs = {};   // in the order of packing
  std::optional<ZarrSharding> sharding = {};
  std::string key_prefix = {};  // of an object's key
  char separator = '.';
  std::vector<std::string> axis_names = {};  // one an axis, where it is said

  std::size_t rank() const { return shape.size(); }
  std::uint64_t chunkSamples() const;
  // Chunks that an object holds.
  std::uint64_t objectChunks() const;
  // Of the object that holds the chunk at these numbers of objects.
  std::string objectKey(const std::vector<std::uint64_t>& numbers) const;
};

// Throws DataError naming the file, the field and the bound: for chunks of no samples and of more than
// `most_chunk_bytes`, for types, filters and codecs that cannot be read.
ZarrArray readZarrArray(const ZarrNode& node, std::uint64_t most_chunk_bytes);

// The steps of reading it that the versions have in common.
std::vector<std::byte> zarrFill(const std::optional<ZarrField>& fill, const SampleFormat& format);
void readZarrVersion2(const ZarrField& metadata, ZarrArray& array);
void readZarrVersion3(const ZarrField& metadata, ZarrArray& array);

}  // namespace blockwalk
