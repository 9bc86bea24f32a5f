// SPDX-License-Identifier: Apache-2.0
// .vgi of Volume Graphics and of Nikon's scanners: sections of text that describe a file of raw voxels beside it.
#include <bit>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/geometry.h"
#include "volume/import/header_text.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

class VgiHeader {
 public:
  explicit VgiHeader(const InputFile& file) : name_(file.name()) {
    HeaderLines lines(file);
    std::string section;
    while (const auto line = lines.next()) {
      const std::string_view text = trimmed(*line);
      if (text.starts_with('[') || text.starts_with('{')) section = lowerCase(text);
      const std::size_t equals = text.find('=');
      if (equals == std::string_view::npos) continue;
      // Of several volumes, and of the files of one, it is the first.
      fields_.try_emplace(section + lowerCase(trimmed(text.substr(0, equals))), trimmed(text.substr(equals + 1)));
    }
  }

  const std::string& name() const { return name_; }
  const std::string* find(const std::string& key) const {
    for (const char* section : {"[file1]", "[representation]", "[geometry]"}) {
      const auto found = fields_.find(section + key);
      if (found != fields_.end() && !found->second.empty()) return &found->second;
    }
    return nullptr;
  }
  const std::string& require(const std::string& key) const {
    const std::string* value = find(key);
    if (value == nullptr) failData("{}: {} is missing", name_, key);
    return *value;
  }
  std::vector<double> numbers(const std::string& key, std::size_t count) const {
    std::vector<double> result;
    for (const std::string_view word : words(require(key))) {
      const auto value = parseReal(word);
      if (!value || !std::isfinite(*value))
        failData("{}: {}: '{}' is no finite number", name_, key, word.substr(0, 40));
      result.push_back(*value);
    }
    if (result.size() != count) failData("{}: {}: {} numbers are given, not {}", name_, key, result.size(), count);
    return result;
  }
  std::int64_t integer(const std::string& key, std::int64_t absent) const {
    const std::string* text = find(key);
    if (text == nullptr) return absent;
    const auto value = parseInteger(*text);
    if (!value || *value < 0) failData("{}: {}: '{}' is no whole number from 0 on", name_, key, text->substr(0, 40));
    return *value;
  }

 private:
  std::string name_;
  std::map<std::string, std::string> fields_;
};

SampleFormat vgiFormat(const VgiHeader& header) {
  const std::string kind = lowerCase(header.require("datatype"));
  const std::int64_t bits = header.integer("bitsperelement", 0);
  const auto as = [&](SampleType type) -> SampleFormat {
    return {.type = type, .swap_bytes = std::endian::native == std::endian::big && sampleBytes(type) > 1};
  };
  const bool is_unsigned = kind == "unsigned integer";
  const bool is_signed = kind == "integer" || kind == "signed integer";
  if ((is_unsigned || is_signed) && bits == 8) return as(is_unsigned ? SampleType::u8 : SampleType::i8);
  if ((is_unsigned || is_signed) && bits == 16) return as(is_unsigned ? SampleType::u16 : SampleType::i16);
  if ((is_unsigned || is_signed) && bits == 32) return as(is_unsigned ? SampleType::u32 : SampleType::i32);
  if (kind == "float" && (bits == 32 || bits == 0)) return as(SampleType::f32);
  if (kind == "float" && bits == 64) return as(SampleType::f64);
  failData("{}: datatype, bitsperelement: '{}' of {} bits cannot be read", header.name(), kind.substr(0, 40), bits);
}

// Programs for Windows write whole paths; the file lies beside the header.
std::string vgiDataName(const std::string& name) { return name.substr(name.find_last_of("/\\") + 1); }

}  // namespace

std::unique_ptr<Source> openVgi(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const VgiHeader header(*file);
  if (const std::string* kind = header.find("fileformat"); kind != nullptr && lowerCase(*kind) != "raw") {
    failData("{}: FileFormat: '{}' cannot be read; raw can", header.name(), kind->substr(0, 40));
  }
  const std::vector<double> size = header.numbers("size", 3);
  for (const double side : size) {
    if (side != std::floor(side) || std::fabs(side) > 1e9)
      failData("{}: size: {} is no whole number", header.name(), side);
  }
  SourceInfo info{.name = file->name(), .format = "vgi"};
  info.dims = checkedDims(static_cast<std::int64_t>(size[0]), static_cast<std::int64_t>(size[1]),
                          static_cast<std::int64_t>(size[2]), header.name(), "size");
  Geometry geometry;
  if (header.find("resolution") != nullptr) {
    const std::vector<double> steps = header.numbers("resolution", 3);
    for (std::size_t i = 0; i < 3; ++i) geometry.axes[i] *= steps[i];
    const std::string* unit = header.find("unit");
    if (unit != nullptr && unit->size() <= kMaxUnitBytes) info.length_unit = *unit;
  }
  info.world_from_index = worldFromIndex(geometry, options.spacing, header.name(), "resolution");
  tellSpacing(options.spacing, header.find("resolution") != nullptr ? "resolution" : "", info);
  const SampleFormat format = vgiFormat(header);
  const auto data = openDataFile(*file, "Name", vgiDataName(header.require("name")));
  const auto begin = static_cast<std::uint64_t>(header.integer("skipheader", 0));
  const std::uint64_t bytes = arrayBytes(format, info.dims);
  if (begin > data->bytes() || data->bytes() - begin != bytes) {
    failData("{}: size: {} bytes of voxels from byte {} are declared, {} has {}", header.name(), bytes, begin,
             data->name(), data->bytes());
  }
  return makeSampleArray({.info = std::move(info), .format = format}, options, readFileBytes(data, begin, bytes));
}

}  // namespace blockwalk
