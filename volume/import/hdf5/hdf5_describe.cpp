// SPDX-License-Identifier: Apache-2.0
#include "volume/import/hdf5/hdf5_describe.h"

#ifdef BLOCKWALK_HDF5
#include <array>
#include <bit>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "volume/error.h"
#include "volume/import/convert/sample.h"
#include "volume/import/hdf5/hdf5_object.h"

namespace blockwalk {
namespace {

struct TypeFound {
  std::optional<SampleFormat> format;
  std::string name;
  bool is_enum = false;
};

bool swapsBytes(hid_t type) {
  const H5T_order_t order = H5Tget_order(type);
  return order != H5T_ORDER_NONE && (order == H5T_ORDER_BE) != (std::endian::native == std::endian::big);
}

std::optional<SampleType> integerOf(std::size_t bytes, bool is_signed) {
  switch (bytes) {
    case 1:
      return is_signed ? SampleType::i8 : SampleType::u8;
    case 2:
      return is_signed ? SampleType::i16 : SampleType::u16;
    case 4:
      return is_signed ? SampleType::i32 : SampleType::u32;
    case 8:
      return is_signed ? SampleType::i64 : SampleType::u64;
    default:
      return std::nullopt;
  }
}

TypeFound integerType(hid_t type, bool is_signed) {
  const std::size_t bytes = H5Tget_size(type);
  const std::size_t bits = H5Tget_precision(type);
  const auto sample = integerOf(bytes, is_signed);
  if (!sample || bits != 8 * bytes || H5Tget_offset(type) != 0) {
    return {.format = {}, .name = fmt::format("integers of {} bits in {} bytes", bits, bytes)};
  }
  return {.format = SampleFormat{.type = *sample, .swap_bytes = bytes > 1 && swapsBytes(type)},
          .name = std::string(sampleTypeName(*sample))};
}

// Of 16 bits libhdf5 of this age has no name.
bool isHalf(hid_t type) {
  std::size_t sign = 0;
  std::size_t exponent = 0;
  std::size_t exponent_bits = 0;
  std::size_t mantissa = 0;
  std::size_t mantissa_bits = 0;
  return H5Tget_fields(type, &sign, &exponent, &exponent_bits, &mantissa, &mantissa_bits) >= 0 && sign == 15 &&
         exponent == 10 && exponent_bits == 5 && mantissa == 0 && mantissa_bits == 10 && H5Tget_ebias(type) == 15;
}

TypeFound floatType(hid_t type) {
  const bool swap = swapsBytes(type);
  const auto found = [&](SampleType sample) {
    return TypeFound{.format = SampleFormat{.type = sample, .swap_bytes = swap},
                     .name = std::string(sampleTypeName(sample))};
  };
  if (H5Tequal(type, H5T_IEEE_F32LE) > 0 || H5Tequal(type, H5T_IEEE_F32BE) > 0) return found(SampleType::f32);
  if (H5Tequal(type, H5T_IEEE_F64LE) > 0 || H5Tequal(type, H5T_IEEE_F64BE) > 0) return found(SampleType::f64);
  if (H5Tget_size(type) == 2 && isHalf(type)) return found(SampleType::f16);
  return {.format = {}, .name = fmt::format("floating point of {} bits that is not IEEE's", 8 * H5Tget_size(type))};
}

TypeFound typeOf(hid_t type) {
  switch (H5Tget_class(type)) {
    case H5T_INTEGER:
      return integerType(type, H5Tget_sign(type) == H5T_SGN_2);
    case H5T_BITFIELD:
      return integerType(type, false);
    case H5T_FLOAT:
      return floatType(type);
    case H5T_ENUM: {
      const Hdf5Handle base(H5Tget_super(type), H5Tclose);
      TypeFound found = integerType(base.get(), H5Tget_sign(base.get()) == H5T_SGN_2);
      found.is_enum = true;
      return found;
    }
    case H5T_COMPOUND:
      return {.format = {}, .name = "compound"};
    case H5T_STRING:
      return {.format = {}, .name = "strings"};
    case H5T_REFERENCE:
      return {.format = {}, .name = "references"};
    case H5T_VLEN:
      return {.format = {}, .name = "lists of variable length"};
    case H5T_ARRAY:
      return {.format = {}, .name = "arrays"};
    case H5T_OPAQUE:
      return {.format = {}, .name = "opaque"};
    default:
      return {.format = {}, .name = "an unknown type"};
  }
}

std::vector<hsize_t> shapeOf(hid_t dataset) {
  const Hdf5Handle space(H5Dget_space(dataset), H5Sclose);
  const int rank = space.isOpen() ? H5Sget_simple_extent_ndims(space.get()) : -1;
  if (rank < 0) failData("its shape is broken");
  std::vector<hsize_t> shape(static_cast<std::size_t>(rank));
  if (rank > 0 && H5Sget_simple_extent_dims(space.get(), shape.data(), nullptr) != rank) {
    failData("its shape is broken");
  }
  if (H5Sget_simple_extent_type(space.get()) == H5S_NULL) shape.assign(1, 0);
  return shape;
}

nlohmann::json filtersOf(hid_t properties) {
  constexpr std::size_t kMostValues = 256;
  nlohmann::json filters = nlohmann::json::array();
  const int count = H5Pget_nfilters(properties);
  for (int i = 0; i < count; ++i) {
    unsigned flags = 0;
    std::size_t number = kMostValues;
    std::array<unsigned, kMostValues> values{};
    std::array<char, 64> name{};
    unsigned config = 0;
    const H5Z_filter_t id = H5Pget_filter2(properties, static_cast<unsigned>(i), &flags, &number, values.data(),
                                           name.size() - 1, name.data(), &config);
    if (id < 0 || number > kMostValues) failData("its filters are broken");
    filters.push_back({{"id", id},
                       {"name", utf8Text(name.data())},
                       {"values", std::vector<unsigned>(values.begin(), values.begin() + static_cast<int>(number))}});
  }
  return filters;
}

nlohmann::json fillOf(hid_t properties, hid_t type, const TypeFound& found) {
  std::vector<std::uint8_t> fill(found.format ? sampleBytes(found.format->type) : 0);
  H5D_fill_value_t kind = H5D_FILL_VALUE_UNDEFINED;
  if (found.format && H5Pfill_value_defined(properties, &kind) >= 0 && kind == H5D_FILL_VALUE_USER_DEFINED) {
    if (H5Pget_fill_value(properties, type, fill.data()) < 0) failData("its fill value is broken");
  }
  return fill;
}

}  // namespace

nlohmann::json describeArray(hid_t dataset) {
  const std::vector<hsize_t> shape = shapeOf(dataset);
  const Hdf5Handle type(H5Dget_type(dataset), H5Tclose);
  const Hdf5Handle properties(H5Dget_create_plist(dataset), H5Pclose);
  if (!type.isOpen() || !properties.isOpen()) failData("its type is broken");
  const TypeFound found = typeOf(type.get());
  nlohmann::json array = {{"shape", shape},
                          {"type", found.name},
                          {"sample", found.format ? static_cast<int>(found.format->type) : -1},
                          {"swap", found.format && found.format->swap_bytes},
                          {"enum", found.is_enum},
                          {"chunk", nlohmann::json::array()},
                          {"packs_edges", true},
                          {"filters", filtersOf(properties.get())},
                          {"fill", fillOf(properties.get(), type.get(), found)}};
  Hdf5Layout layout = Hdf5Layout::contiguous;
  switch (H5Pget_layout(properties.get())) {
    case H5D_COMPACT:
      layout = Hdf5Layout::compact;
      break;
    case H5D_CONTIGUOUS:
      if (H5Pget_external_count(properties.get()) > 0) layout = Hdf5Layout::external;
      break;
    case H5D_CHUNKED: {
      layout = Hdf5Layout::chunked;
      std::vector<hsize_t> chunk(shape.size());
      unsigned options = 0;
      if (H5Pget_chunk(properties.get(), static_cast<int>(chunk.size()), chunk.data()) !=
              static_cast<int>(chunk.size()) ||
          H5Pget_chunk_opts(properties.get(), &options) < 0) {
        failData("its chunks are broken");
      }
      array["chunk"] = chunk;
      array["packs_edges"] = (options & H5D_CHUNK_DONT_FILTER_PARTIAL_CHUNKS) == 0;
      break;
    }
    case H5D_VIRTUAL:
      layout = Hdf5Layout::mapped;
      break;
    default:
      failData("its layout is broken");
  }
  array["layout"] = static_cast<int>(layout);
  if (layout == Hdf5Layout::contiguous) {
    const haddr_t offset = H5Dget_offset(dataset);
    if (offset != HADDR_UNDEF) array["offset"] = offset;
  }
  return array;
}

}  // namespace blockwalk
#endif
