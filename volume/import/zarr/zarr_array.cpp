// SPDX-License-Identifier: Apache-2.0
#include "volume/import/zarr/zarr_array.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <limits>
#include <numeric>

#include "volume/error.h"
#include "volume/import/convert/half.h"

namespace blockwalk {
namespace {

std::uint64_t productOf(const std::vector<std::uint64_t>& sizes) {
  return std::accumulate(sizes.begin(), sizes.end(), std::uint64_t{1}, std::multiplies<>());
}

// Whether the product is at most `most`; it need not fit 64 bits.
bool isProductAtMost(const std::vector<std::uint64_t>& sizes, std::uint64_t most) {
  for (const std::uint64_t size : sizes) {
    if (size > most) return false;
    most /= size;
  }
  return true;
}

template <typename T>
std::vector<std::byte> sampleOf(T value) {
  std::vector<std::byte> bytes(sizeof value);
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

template <typename T>
std::vector<std::byte> integerFill(const ZarrField& fill) {
  const nlohmann::json& value = fill.value();
  if (value.is_boolean()) return sampleOf(static_cast<T>(value.get<bool>()));
  // Of those above what 64 bits with a sign hold only u64 has any.
  if constexpr (std::is_same_v<T, std::uint64_t>) {
    if (value.is_number_unsigned()) return sampleOf(value.get<std::uint64_t>());
  }
  const std::int64_t integer = fill.integer();
  if (!std::in_range<T>(integer)) fill.fail("must be a value of the array's type");
  return sampleOf(static_cast<T>(integer));
}

// A number, one of three names, or the bits in hexadecimal.
template <typename T, typename Bits>
std::vector<std::byte> realFill(const ZarrField& fill) {
  if (!fill.value().is_string()) return sampleOf(static_cast<T>(fill.number()));
  const std::string text = fill.text();
  if (text == "NaN") return sampleOf(std::numeric_limits<T>::quiet_NaN());
  if (text == "Infinity") return sampleOf(std::numeric_limits<T>::infinity());
  if (text == "-Infinity") return sampleOf(-std::numeric_limits<T>::infinity());
  Bits bits = 0;
  const char* end = text.data() + text.size();
  const bool is_hex = text.starts_with("0x") && std::from_chars(text.data() + 2, end, bits, 16).ptr == end;
  if (!is_hex || text.size() != 2 + 2 * sizeof(Bits)) fill.fail("must be a number, NaN, Infinity or bits as 0x...");
  return sampleOf(std::bit_cast<T>(bits));
}

std::vector<std::byte> halfFill(const ZarrField& fill) {
  const bool is_hex = fill.value().is_string() && fill.text().starts_with("0x");
  if (!is_hex) {
    float value = 0;
    std::memcpy(&value, realFill<float, std::uint32_t>(fill).data(), sizeof value);
    return sampleOf(halfFromFloat(value));
  }
  const std::string text = fill.text();
  std::uint16_t bits = 0;
  const char* end = text.data() + text.size();
  if (text.size() != 6 || std::from_chars(text.data() + 2, end, bits, 16).ptr != end) fill.fail("must be 16 bits");
  return sampleOf(bits);
}

std::vector<std::byte> nativeFill(const ZarrField& fill, SampleType type) {
  switch (type) {
    case SampleType::u8:
      return integerFill<std::uint8_t>(fill);
    case SampleType::i8:
      return integerFill<std::int8_t>(fill);
    case SampleType::u16:
      return integerFill<std::uint16_t>(fill);
    case SampleType::i16:
      return integerFill<std::int16_t>(fill);
    case SampleType::u32:
      return integerFill<std::uint32_t>(fill);
    case SampleType::i32:
      return integerFill<std::int32_t>(fill);
    case SampleType::u64:
      return integerFill<std::uint64_t>(fill);
    case SampleType::i64:
      return integerFill<std::int64_t>(fill);
    case SampleType::f16:
      return halfFill(fill);
    case SampleType::f32:
      return realFill<float, std::uint32_t>(fill);
    case SampleType::f64:
      return realFill<double, std::uint64_t>(fill);
  }
  return {};
}

void checkChunks(const ZarrArray& array, const ZarrField& metadata, std::uint64_t most_chunk_bytes) {
  if (array.object_chunk.size() != array.rank() || array.chunk.size() != array.rank()) {
    metadata.fail(fmt::format("chunks must have {} sizes, one an axis", array.rank()));
  }
  const std::uint64_t most = most_chunk_bytes / sampleBytes(array.format.type);
  if (!isProductAtMost(array.chunk, most)) {
    failData("{}: chunk shape: a chunk has more than {} bytes, a sixteenth of --memory", array.file, most_chunk_bytes);
  }
  std::vector<std::uint64_t> counts;
  for (std::size_t axis = 0; axis < array.rank(); ++axis) {
    if (array.object_chunk[axis] % array.chunk[axis] != 0) {
      failData("{}: sharding_indexed: chunks of {} do not divide shards of {} on axis {}", array.file,
               array.chunk[axis], array.object_chunk[axis], axis);
    }
    counts.push_back(array.object_chunk[axis] / array.chunk[axis]);
  }
  constexpr std::uint64_t kEntryBytes = 16;
  if (!isProductAtMost(counts, most_chunk_bytes / kEntryBytes)) {
    failData("{}: sharding_indexed: the index of a shard has more than {} bytes, a sixteenth of --memory", array.file,
             most_chunk_bytes);
  }
}

}  // namespace

std::uint64_t ZarrArray::chunkSamples() const { return productOf(chunk); }

std::uint64_t ZarrArray::objectChunks() const { return productOf(object_chunk) / productOf(chunk); }

std::string ZarrArray::objectKey(const std::vector<std::uint64_t>& numbers) const {
  std::string name = key_prefix;
  for (const std::uint64_t number : numbers) {
    if (!name.empty()) name += separator;
    name += std::to_string(number);
  }
  return joinKeys(key, name);
}

std::vector<std::byte> zarrFill(const std::optional<ZarrField>& fill, const SampleFormat& format) {
  std::vector<std::byte> sample(sampleBytes(format.type));
  if (fill) sample = nativeFill(*fill, format.type);
  if (format.swap_bytes) std::reverse(sample.begin(), sample.end());
  return sample;
}

ZarrArray readZarrArray(const ZarrNode& node, std::uint64_t most_chunk_bytes) {
  const ZarrField metadata = node.metadataField();
  ZarrArray array{.key = node.key, .file = node.metadataFile()};
  array.shape = metadata.get("shape").sizes(1);
  if (node.version == 3) {
    readZarrVersion3(metadata, array);
  } else {
    readZarrVersion2(metadata, array);
  }
  checkChunks(array, metadata, most_chunk_bytes);
  if (const auto names = node.attributesField().find("_ARRAY_DIMENSIONS"); names && array.axis_names.empty()) {
    array.axis_names = names->texts();
  }
  if (array.axis_names.size() != array.rank()) array.axis_names.clear();
  return array;
}

}  // namespace blockwalk
