// SPDX-License-Identifier: Apache-2.0
// zarr.json of Zarr version 3: chunk grid, keys, and the chain of codecs.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <string_view>
#include <utility>

#include "volume/import/zarr/zarr_array.h"

namespace blockwalk {
namespace {

SampleType typeOfVersion3(const ZarrField& field) {
  static constexpr std::pair<std::string_view, SampleType> kTypes[] = {
      {"bool", SampleType::u8},     {"int8", SampleType::i8},     {"int16", SampleType::i16},
      {"int32", SampleType::i32},   {"int64", SampleType::i64},   {"uint8", SampleType::u8},
      {"uint16", SampleType::u16},  {"uint32", SampleType::u32},  {"uint64", SampleType::u64},
      {"float16", SampleType::f16}, {"float32", SampleType::f32}, {"float64", SampleType::f64}};
  const std::string text = field.text();
  for (const auto& [name, type] : kTypes) {
    if (text != name) continue;
    return type;
  }
  field.fail("bool, int8..int64, uint8..uint64 and float16..float64 can be read");
}

using Order = std::vector<std::size_t>;

Order inOrder(std::size_t rank) {
  Order order(rank);
  std::iota(order.begin(), order.end(), std::size_t{0});
  return order;
}

// A chain of codecs as it is read, from the array to bytes.
struct Chain {
  Order order = {};                        // axes as they lie, from the one that changes last
  std::optional<ZarrField> sharding = {};  // its configuration
  bool swap_bytes = false;
  bool has_serializer = false;
  std::vector<ZarrCodec> codecs = {};
};

void transpose(const ZarrField& codec, Chain& chain) {
  const ZarrField order = codec.get("configuration").get("order");
  Order by;
  if (order.value().is_string()) {
    if (order.text() != "C" && order.text() != "F") order.fail("must be C, F or a list of axes");
    by = inOrder(chain.order.size());
    if (order.text() == "F") std::reverse(by.begin(), by.end());
  } else {
    for (const std::uint64_t axis : order.sizes(0)) by.push_back(static_cast<std::size_t>(axis));
  }
  Order sorted = by;
  std::ranges::sort(sorted);
  if (sorted != inOrder(chain.order.size())) order.fail("must name every axis once");
  Order result;
  for (const std::size_t axis : by) result.push_back(chain.order[axis]);
  chain.order = result;
}

void serialise(const ZarrField& codec, std::size_t sample_bytes, Chain& chain) {
  chain.has_serializer = true;
  const auto configuration = codec.find("configuration");
  const auto endian = configuration ? configuration->find("endian") : std::nullopt;
  if (!endian) {
    if (sample_bytes > 1) codec.fail("lacks configuration.endian");
    return;
  }
  if (endian->text() != "little" && endian->text() != "big") endian->fail("must be little or big");
  const bool is_little = endian->text() == "little";
  chain.swap_bytes = sample_bytes > 1 && is_little != (std::endian::native == std::endian::little);
}

Chain readChain(const ZarrField& codecs, Order order, std::size_t sample_bytes) {
  Chain chain{.order = std::move(order)};
  for (const ZarrField& codec : codecs.elements()) {
    const ZarrField name = codec.value().is_string() ? codec : codec.get("name");
    const std::string text = name.text();
    if (text == "transpose" && !chain.has_serializer) {
      transpose(codec, chain);
    } else if (text == "bytes" && !chain.has_serializer) {
      codec.value().is_string() ? name.fail("must be an object") : serialise(codec, sample_bytes, chain);
    } else if (text == "sharding_indexed" && !chain.has_serializer) {
      chain.has_serializer = true;
      chain.sharding = codec.get("configuration");
    } else if (const auto known = zarrCodec(text); known && chain.has_serializer) {
      if (chain.sharding) name.fail("what packs whole shards cannot be undone");
      chain.codecs.push_back(*known);
    } else {
      name.fail(fmt::format("transpose, then bytes or sharding_indexed, then {} can be read", kZarrCodecNames));
    }
  }
  if (!chain.has_serializer) codecs.fail("lacks bytes");
  return chain;
}

// Sizes by place in `order`, as sizes by axis.
std::vector<std::uint64_t> byAxis(const ZarrField& field, const Order& order) {
  const std::vector<std::uint64_t> sizes = field.sizes(1);
  if (sizes.size() != order.size()) field.fail(fmt::format("must have {} sizes", order.size()));
  std::vector<std::uint64_t> result(sizes.size());
  for (std::size_t i = 0; i < order.size(); ++i) result[order[i]] = sizes[i];
  return result;
}

// The index of a shard is numbers of 64 bits, little endian, with checksums at most.
std::vector<ZarrCodec> indexCodecs(const ZarrField& codecs, std::size_t rank) {
  constexpr std::size_t kNumberBytes = 8;
  Chain chain = readChain(codecs, inOrder(rank + 1), kNumberBytes);
  const bool is_plain = !chain.sharding && !chain.swap_bytes && chain.order == inOrder(rank + 1);
  if (!is_plain || std::ranges::any_of(chain.codecs, [](ZarrCodec codec) { return codec != ZarrCodec::crc32c; })) {
    codecs.fail("bytes (little endian) and crc32c can be read");
  }
  return chain.codecs;
}

Chain readSharding(const Chain& outer, std::size_t sample_bytes, ZarrArray& array) {
  const ZarrField& configuration = *outer.sharding;
  array.chunk = byAxis(configuration.get("chunk_shape"), outer.order);
  ZarrSharding sharding{.index_codecs = indexCodecs(configuration.get("index_codecs"), array.rank()),
                        .order = outer.order};
  if (const auto location = configuration.find("index_location")) {
    if (location->text() != "start" && location->text() != "end") location->fail("must be start or end");
    sharding.index_at_start = location->text() == "start";
  }
  array.sharding = std::move(sharding);
  const ZarrField codecs = configuration.get("codecs");
  Chain inner = readChain(codecs, outer.order, sample_bytes);
  if (inner.sharding) codecs.fail("shards inside shards cannot be read");
  return inner;
}

void readKeys(const ZarrField& metadata, ZarrArray& array) {
  const ZarrField encoding = metadata.get("chunk_key_encoding");
  const ZarrField name = encoding.get("name");
  if (name.text() != "default" && name.text() != "v2") name.fail("must be default or v2");
  const bool is_default = name.text() == "default";
  if (is_default) array.key_prefix.assign(1, 'c');
  array.separator = is_default ? '/' : '.';
  const auto configuration = encoding.find("configuration");
  const auto separator = configuration ? configuration->find("separator") : std::nullopt;
  if (!separator) return;
  if (separator->text() != "." && separator->text() != "/") separator->fail("must be . or /");
  array.separator = separator->text()[0];
}

}  // namespace

void readZarrVersion3(const ZarrField& metadata, ZarrArray& array) {
  const ZarrField grid = metadata.get("chunk_grid");
  if (const ZarrField name = grid.get("name"); name.text() != "regular") name.fail("must be regular");
  const Order natural = inOrder(array.rank());
  array.object_chunk = array.chunk = byAxis(grid.get("configuration").get("chunk_shape"), natural);
  readKeys(metadata, array);
  array.format.type = typeOfVersion3(metadata.get("data_type"));
  const std::size_t bytes = sampleBytes(array.format.type);
  Chain chain = readChain(metadata.get("codecs"), natural, bytes);
  if (chain.sharding) chain = readSharding(chain, bytes, array);
  array.order = std::move(chain.order);
  array.codecs = std::move(chain.codecs);
  array.format.swap_bytes = chain.swap_bytes;
  array.fill = zarrFill(metadata.get("fill_value"), array.format);
  if (const auto transformers = metadata.find("storage_transformers")) {
    for (const ZarrField& transformer : transformers->elements()) transformer.fail("cannot be undone");
  }
  const auto names = metadata.find("dimension_names");
  if (!names) return;
  for (const ZarrField& name : names->elements()) {
    array.axis_names.push_back(name.value().is_null() ? std::string() : name.text());
  }
}

}  // namespace blockwalk
