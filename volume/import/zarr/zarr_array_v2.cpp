// SPDX-License-Identifier: Apache-2.0
// .zarray of Zarr version 2.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <string_view>
#include <utility>

#include "volume/import/zarr/zarr_array.h"

namespace blockwalk {
namespace {

// "<u2": byte order, kind, bytes.
SampleFormat formatOfVersion2(const ZarrField& field) {
  static constexpr std::pair<std::string_view, SampleType> kTypes[] = {
      {"b1", SampleType::u8},  {"i1", SampleType::i8},  {"i2", SampleType::i16}, {"i4", SampleType::i32},
      {"i8", SampleType::i64}, {"u1", SampleType::u8},  {"u2", SampleType::u16}, {"u4", SampleType::u32},
      {"u8", SampleType::u64}, {"f2", SampleType::f16}, {"f4", SampleType::f32}, {"f8", SampleType::f64}};
  const std::string text = field.text();
  constexpr bool kIsLittle = std::endian::native == std::endian::little;
  for (const auto& [name, type] : kTypes) {
    if (text.size() != 3 || text.substr(1) != name) continue;
    const char order = text[0];
    if (order != '<' && order != '>' && order != '=' && (order != '|' || text[2] != '1')) break;
    const bool swap = (order == '>' && kIsLittle) || (order == '<' && !kIsLittle);
    return {.type = type, .swap_bytes = swap && text[2] != '1'};
  }
  field.fail("of types <, > or | and b1, i1, i2, i4, i8, u1, u2, u4, u8, f2, f4, f8 can be read");
}

void refuseFilters(const ZarrField& metadata) {
  const auto filters = metadata.find("filters");
  if (!filters) return;
  for (const ZarrField& filter : filters->elements()) filter.get("id").fail("filters cannot be undone");
}

}  // namespace

void readZarrVersion2(const ZarrField& metadata, ZarrArray& array) {
  array.chunk = array.object_chunk = metadata.get("chunks").sizes(1);
  array.format = formatOfVersion2(metadata.get("dtype"));
  array.fill = zarrFill(metadata.find("fill_value"), array.format);
  refuseFilters(metadata);
  if (const auto compressor = metadata.find("compressor")) {
    const ZarrField name = compressor->get("id");
    const auto codec = zarrCodec(name.text());
    if (!codec) name.fail(fmt::format("{} can be unpacked", kZarrCodecNames));
    array.codecs = {*codec};
  }
  const ZarrField order = metadata.get("order");
  if (order.text() != "C" && order.text() != "F") order.fail("must be C or F");
  array.order.resize(array.rank());
  std::iota(array.order.begin(), array.order.end(), std::size_t{0});
  if (order.text() == "F") std::reverse(array.order.begin(), array.order.end());
  if (const auto separator = metadata.find("dimension_separator")) {
    if (separator->text() != "." && separator->text() != "/") separator->fail("must be . or /");
    array.separator = separator->text()[0];
  }
}

}  // namespace blockwalk
