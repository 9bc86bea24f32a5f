// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/geometry.h"
#include "volume/import/header_text.h"
#include "volume/import/openers.h"
#include "volume/import/text/text_samples.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

class MetaHeader {
 public:
  // Reads up to and with ElementDataFile, which is the last line.
  explicit MetaHeader(const InputFile& file) : name_(file.name()) {
    HeaderLines lines(file);
    while (auto line = lines.next()) {
      if (trimmed(*line).empty()) continue;
      const std::size_t equals = line->find('=');
      if (equals == std::string_view::npos) failData("{}: header line '{}' is no field", name_, line->substr(0, 80));
      const std::string key(trimmed(line->substr(0, equals)));
      const bool added = fields_.emplace(key, trimmed(line->substr(equals + 1))).second;
      if (!added) failData("{}: {}: the field stands in the header twice", name_, key);
      if (key == "ElementDataFile") break;
    }
    data_begin_ = lines.position();
    if (find("ElementDataFile") == nullptr) failData("{}: ElementDataFile: the field is missing", name_);
  }

  const std::string& name() const { return name_; }
  std::uint64_t dataBegin() const { return data_begin_; }

  const std::string* find(const std::string& key) const {
    const auto found = fields_.find(key);
    return found == fields_.end() ? nullptr : &found->second;
  }
  const std::string* findAny(std::initializer_list<const char*> keys) const {
    for (const char* key : keys) {
      if (const std::string* value = find(key)) return value;
    }
    return nullptr;
  }
  const std::string& require(const std::string& key) const {
    const std::string* value = find(key);
    if (value == nullptr) failData("{}: {}: the field is missing", name_, key);
    return *value;
  }
  bool flag(std::initializer_list<const char*> keys, bool absent) const {
    const std::string* value = findAny(keys);
    if (value == nullptr) return absent;
    const std::string text = lowerCase(*value);
    if (text == "true" || text == "1") return true;
    if (text == "false" || text == "0") return false;
    failData("{}: {}: '{}' is neither True nor False", name_, *keys.begin(), text);
  }
  std::int64_t integer(const std::string& key, std::int64_t absent) const {
    const std::string* text = find(key);
    if (text == nullptr) return absent;
    const auto value = parseInteger(*text);
    if (!value) failData("{}: {}: '{}' is no whole number", name_, key, text->substr(0, 40));
    return *value;
  }
  std::vector<double> reals(const std::string& key, const std::string& text, std::size_t count) const {
    std::vector<double> result;
    for (const std::string_view word : words(text)) {
      const auto value = parseReal(word);
      if (!value || !std::isfinite(*value)) failData("{}: {}: '{}' is no finite number", name_, key, word);
      result.push_back(*value);
    }
    if (result.size() != count) failData("{}: {}: {} numbers are given, not {}", name_, key, result.size(), count);
    return result;
  }

 private:
  std::string name_;
  std::map<std::string, std::string> fields_;
  std::uint64_t data_begin_ = 0;
};

SampleFormat readFormat(const MetaHeader& header) {
  static const std::map<std::string, SampleType, std::less<>> kTypes = {
      {"MET_CHAR", SampleType::i8},        {"MET_UCHAR", SampleType::u8},  {"MET_SHORT", SampleType::i16},
      {"MET_USHORT", SampleType::u16},     {"MET_INT", SampleType::i32},   {"MET_UINT", SampleType::u32},
      {"MET_LONG", SampleType::i32},       {"MET_ULONG", SampleType::u32}, {"MET_LONG_LONG", SampleType::i64},
      {"MET_ULONG_LONG", SampleType::u64}, {"MET_FLOAT", SampleType::f32}, {"MET_DOUBLE", SampleType::f64}};
  const std::string& name = header.require("ElementType");
  const auto found = kTypes.find(name);
  if (found == kTypes.end()) failData("{}: ElementType: '{}' cannot be read", header.name(), name);
  const std::int64_t channels = header.integer("ElementNumberOfChannels", 1);
  if (channels < 1 || channels > kMaxChannels) {
    failData("{}: ElementNumberOfChannels: {} is outside 1..{}", header.name(), channels, kMaxChannels);
  }
  const bool big = header.flag({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}, false);
  const bool swap = big != (std::endian::native == std::endian::big);
  return {found->second, static_cast<int>(channels), swap && sampleBytes(found->second) > 1};
}

std::size_t readAxisCount(const MetaHeader& header) {
  const std::int64_t count = header.integer("NDims", 0);
  if (count != 2 && count != 3) failData("{}: NDims: {} is neither 2 nor 3", header.name(), count);
  return static_cast<std::size_t>(count);
}

glm::ivec3 readDims(const MetaHeader& header, std::size_t axis_count) {
  std::vector<std::int64_t> sizes;
  for (const std::string_view word : words(header.require("DimSize"))) {
    const auto size = parseInteger(word);
    if (!size) failData("{}: DimSize: '{}' is no whole number", header.name(), word);
    sizes.push_back(*size);
  }
  if (sizes.size() != axis_count) {
    failData("{}: DimSize: {} are given, NDims is {}", header.name(), sizes.size(), axis_count);
  }
  sizes.resize(3, 1);
  return checkedDims(sizes[0], sizes[1], sizes[2], header.name(), "DimSize");
}

// Row i of the matrix is the direction of axis i; the offset is the centre of the first voxel.
Geometry readGeometry(const MetaHeader& header, std::size_t axis_count) {
  Geometry geometry;
  if (const std::string* matrix = header.findAny({"TransformMatrix", "Orientation", "Rotation"})) {
    const auto values = header.reals("TransformMatrix", *matrix, axis_count * axis_count);
    for (std::size_t i = 0; i < axis_count; ++i) {
      geometry.axes[i] = glm::dvec3{0};
      for (std::size_t j = 0; j < axis_count; ++j) geometry.axes[i][static_cast<int>(j)] = values[i * axis_count + j];
    }
  }
  if (const std::string* spacing = header.findAny({"ElementSpacing", "ElementSize"})) {
    const auto values = header.reals("ElementSpacing", *spacing, axis_count);
    for (std::size_t i = 0; i < axis_count; ++i) geometry.axes[i] *= values[i];
  }
  if (const std::string* offset = header.findAny({"Offset", "Position", "Origin"})) {
    const auto values = header.reals("Offset", *offset, axis_count);
    geometry.first_center = glm::dvec3(values[0], values[1], axis_count == 3 ? values[2] : 0.0);
  }
  return geometry;
}

std::unique_ptr<ByteReader> openData(const MetaHeader& header, std::shared_ptr<const InputFile> file,
                                     const SampleFormat& format, glm::ivec3 dims, std::uint64_t memory_bytes) {
  const std::string& data_file = header.require("ElementDataFile");
  std::uint64_t begin = header.dataBegin();
  if (data_file.starts_with("LIST") || data_file.find('%') != std::string::npos) {
    failData("{}: ElementDataFile: '{}' spreads the data over several files, which cannot be read", header.name(),
             data_file);
  }
  if (data_file != "LOCAL") {
    file = openDataFile(*file, "ElementDataFile", data_file);
    begin = 0;
  }
  const std::uint64_t bytes = arrayBytes(format, dims);
  const bool compressed = header.flag({"CompressedData"}, false);
  const std::int64_t header_bytes = header.integer("HeaderSize", 0);
  if (header_bytes < -1) failData("{}: HeaderSize: {} is below -1", header.name(), header_bytes);
  if (header_bytes == -1) {
    if (compressed) failData("{}: HeaderSize: -1 does not go with compressed data", header.name());
    if (bytes > file->bytes()) {
      failData("{}: DimSize: {} bytes of voxels are declared, {} has {}", header.name(), bytes, file->name(),
               file->bytes());
    }
    begin = file->bytes() - bytes;
  } else if (header_bytes > 0) {
    begin = static_cast<std::uint64_t>(header_bytes);
  }
  if (!header.flag({"BinaryData"}, true)) {
    return readMemoryBytes(readTextSamples(*file, begin, format.type, bytes / sampleBytes(format.type), memory_bytes));
  }
  if (compressed) return readCompressedBytes(file, begin, 0, bytes);
  const std::uint64_t left = file->bytes() - std::min(begin, file->bytes());
  if (left != bytes) {
    failData("{}: DimSize: {} bytes of voxels are declared, {} has {} from byte {} on", header.name(), bytes,
             file->name(), left, begin);
  }
  return readFileBytes(file, begin, bytes);
}

}  // namespace

std::unique_ptr<Source> openMetaImage(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const MetaHeader header(*file);
  if (const std::string* type = header.find("ObjectType"); type != nullptr && *type != "Image") {
    failData("{}: ObjectType: '{}' is not Image", header.name(), *type);
  }
  const std::size_t axis_count = readAxisCount(header);
  SampleFormat format = readFormat(header);
  if (!header.flag({"BinaryData"}, true)) format.swap_bytes = false;
  SourceInfo info{.name = file->name(), .format = "metaimage", .dims = readDims(header, axis_count)};
  info.world_from_index = worldFromIndex(readGeometry(header, axis_count), options.spacing, header.name(),
                                         "TransformMatrix, ElementSpacing");
  // For people only; "?" is what nobody said.
  const std::string* unit = header.find("DistanceUnits");
  if (unit != nullptr && *unit != "?" && unit->size() <= kMaxUnitBytes) info.length_unit = *unit;
  // Three or four bytes or words are a colour, as everybody writes them; the format has no word for it.
  const bool is_color = format.channels > 2 && (format.type == SampleType::u8 || format.type == SampleType::u16);
  auto bytes = openData(header, file, format, info.dims, options.memory_bytes);
  return makeSampleArray({.info = std::move(info), .format = format, .is_color = is_color, .order = ArrayOrder::voxels},
                         options, std::move(bytes));
}

}  // namespace blockwalk
