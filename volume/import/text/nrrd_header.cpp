// SPDX-License-Identifier: Apache-2.0
#include "volume/import/text/nrrd_header.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/header_text.h"
#include "volume/import/text/nrrd_keys.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

using Fields = std::map<std::string, std::string>;

std::string unquoted(std::string_view text) {
  const bool quoted = text.size() >= 2 && text.front() == '"' && text.back() == '"';
  return std::string(quoted ? text.substr(1, text.size() - 2) : text);
}

// One spelling for fields that have two.
std::string canonicalField(std::string name) {
  if (name == "datafile") return "data file";
  if (name == "lineskip") return "line skip";
  if (name == "byteskip") return "byte skip";
  if (name == "sampleunits") return "sample units";
  return name;
}

// `own`: the keys with our prefix.
Fields readFields(const InputFile& file, NrrdHeader& header, Fields& own) {
  HeaderLines lines(file);
  const auto magic = lines.next();
  if (!magic || magic->size() != 8 || !magic->starts_with("NRRD000") || (*magic)[7] < '1' || (*magic)[7] > '5') {
    failData("{}: the first line is not NRRD0001 to NRRD0005", file.name());
  }
  Fields fields;
  while (auto line = lines.next()) {
    if (line->empty()) break;
    if (line->starts_with('#')) continue;
    const std::size_t colon = line->find(':');
    if (colon == std::string_view::npos) failData("{}: header line '{}' is no field", file.name(), line->substr(0, 80));
    if (line->substr(colon).starts_with(":=")) {  // a key of the user's own, or of ours
      const std::string_view key = line->substr(0, colon);
      if (key.starts_with(kNrrdKeyPrefix)) own.emplace(key.substr(kNrrdKeyPrefix.size()), line->substr(colon + 2));
      continue;
    }
    const std::string name = canonicalField(lowerCase(trimmed(line->substr(0, colon))));
    const bool added = fields.emplace(name, trimmed(line->substr(colon + 1))).second;
    if (!added) failData("{}: {}: the field stands in the header twice", file.name(), name);
  }
  header.data_begin = lines.position();
  return fields;
}

class NrrdReader {
 public:
  explicit NrrdReader(const InputFile& file) : file_(file), fields_(readFields(file, header_, own_)) {}

  NrrdHeader read() {
    readEncoding();
    readType();
    readSizes();
    readGeometry();
    readUnits();
    readKeys();
    return header_;
  }

 private:
  const std::string* find(const std::string& name) const {
    const auto found = fields_.find(name);
    return found == fields_.end() ? nullptr : &found->second;
  }
  const std::string& require(const std::string& name) const {
    const std::string* value = find(name);
    if (value == nullptr) failData("{}: {}: the field is missing", file_.name(), name);
    return *value;
  }
  std::int64_t integer(const std::string& name, std::string_view text) const {
    const auto value = parseInteger(text);
    if (!value) failData("{}: {}: '{}' is no whole number", file_.name(), name, text.substr(0, 40));
    return *value;
  }

  void readEncoding();
  void readType();
  void readSizes();
  void readGeometry();
  void readUnits();
  void readKeys();
  std::string kindOf(std::size_t axis) const;
  bool firstAxisIsColor(const std::vector<std::int64_t>& sizes) const;
  bool isChannels(const std::vector<std::int64_t>& sizes, std::size_t axis) const;
  void takeSampleAxis(std::vector<std::int64_t>& sizes);
  std::vector<std::optional<glm::dvec3>> vectors(const std::string& name, std::string_view text) const;
  std::vector<std::optional<glm::dvec3>> axisSteps() const;

  const InputFile& file_;
  NrrdHeader header_;
  Fields own_;
  Fields fields_;
  std::size_t axis_count_ = 0;
  std::size_t first_space_axis_ = 0;  // 1 when axis 0 is the samples of a voxel
  std::size_t end_space_axis_ = 0;    // one below axis_count_ when the last axis is
};

void NrrdReader::readEncoding() {
  const std::string encoding = lowerCase(require("encoding"));
  if (encoding == "raw") {
    header_.encoding = NrrdEncoding::raw;
  } else if (encoding == "gzip" || encoding == "gz") {
    header_.encoding = NrrdEncoding::gzip;
  } else if (encoding == "ascii" || encoding == "text" || encoding == "txt") {
    header_.encoding = NrrdEncoding::text;
  } else {
    failData("{}: encoding: '{}' cannot be read; raw, gzip and ascii can", file_.name(), encoding);
  }
  if (const std::string* skip = find("line skip")) {
    const std::int64_t lines = integer("line skip", *skip);
    if (lines < 0) failData("{}: line skip: {} is below 0", file_.name(), lines);
    header_.line_skip = static_cast<std::uint64_t>(lines);
  }
  if (const std::string* skip = find("byte skip")) {
    header_.byte_skip = integer("byte skip", *skip);
    if (header_.byte_skip < -1) failData("{}: byte skip: {} is below -1", file_.name(), header_.byte_skip);
  }
  if (const std::string* name = find("data file")) {
    if (name->empty()) failData("{}: data file: no name is given", file_.name());
    if (name->starts_with("LIST") || name->find('%') != std::string::npos) {
      failData("{}: data file: '{}' spreads the data over several files, which cannot be read", file_.name(), *name);
    }
    header_.data_file = *name;
  }
}

void NrrdReader::readType() {
  static const std::map<std::string, SampleType, std::less<>> kTypes = {{"signed char", SampleType::i8},
                                                                        {"int8", SampleType::i8},
                                                                        {"int8_t", SampleType::i8},
                                                                        {"uchar", SampleType::u8},
                                                                        {"unsigned char", SampleType::u8},
                                                                        {"uint8", SampleType::u8},
                                                                        {"uint8_t", SampleType::u8},
                                                                        {"short", SampleType::i16},
                                                                        {"short int", SampleType::i16},
                                                                        {"signed short", SampleType::i16},
                                                                        {"signed short int", SampleType::i16},
                                                                        {"int16", SampleType::i16},
                                                                        {"int16_t", SampleType::i16},
                                                                        {"ushort", SampleType::u16},
                                                                        {"unsigned short", SampleType::u16},
                                                                        {"unsigned short int", SampleType::u16},
                                                                        {"uint16", SampleType::u16},
                                                                        {"uint16_t", SampleType::u16},
                                                                        {"int", SampleType::i32},
                                                                        {"signed int", SampleType::i32},
                                                                        {"int32", SampleType::i32},
                                                                        {"int32_t", SampleType::i32},
                                                                        {"uint", SampleType::u32},
                                                                        {"unsigned int", SampleType::u32},
                                                                        {"uint32", SampleType::u32},
                                                                        {"uint32_t", SampleType::u32},
                                                                        {"longlong", SampleType::i64},
                                                                        {"long long", SampleType::i64},
                                                                        {"long long int", SampleType::i64},
                                                                        {"signed long long", SampleType::i64},
                                                                        {"signed long long int", SampleType::i64},
                                                                        {"int64", SampleType::i64},
                                                                        {"int64_t", SampleType::i64},
                                                                        {"ulonglong", SampleType::u64},
                                                                        {"unsigned long long", SampleType::u64},
                                                                        {"unsigned long long int", SampleType::u64},
                                                                        {"uint64", SampleType::u64},
                                                                        {"uint64_t", SampleType::u64},
                                                                        {"float", SampleType::f32},
                                                                        {"double", SampleType::f64}};
  const std::string name = lowerCase(require("type"));
  const auto found = kTypes.find(name);
  if (found == kTypes.end()) failData("{}: type: '{}' is not known", file_.name(), name);
  header_.format.type = found->second;

  const bool has_order = sampleBytes(header_.format.type) > 1 && header_.encoding != NrrdEncoding::text;
  if (!has_order) return;
  const std::string endian = lowerCase(require("endian"));
  if (endian != "little" && endian != "big")
    failData("{}: endian: '{}' is neither little nor big", file_.name(), endian);
  header_.format.swap_bytes = (endian == "big") != (std::endian::native == std::endian::big);
}

// The kind of an axis in lower case, empty where `kinds` does not say it.
std::string NrrdReader::kindOf(std::size_t axis) const {
  const std::string* kinds = find("kinds");
  const auto names = words(kinds != nullptr ? std::string_view(*kinds) : std::string_view());
  return axis < names.size() ? lowerCase(names[axis]) : "";
}

bool isUnnamed(std::string_view kind) { return kind.empty() || kind == "???" || kind == "none"; }

bool isListing(std::string_view kind) {
  return kind == "list" || kind == "vector" || kind == "2-vector" || kind == "3-vector" || kind == "4-vector";
}

bool NrrdReader::firstAxisIsColor(const std::vector<std::int64_t>& sizes) const {
  if (sizes[0] != 3 && sizes[0] != 4) return false;
  const std::string kind = kindOf(0);
  if (kind == "rgb-color" || kind == "3-color") return sizes[0] == 3;
  if (kind == "rgba-color" || kind == "4-color") return sizes[0] == 4;
  // Three slices of a scalar are a volume: without a name for it, only a fourth axis makes the first one colour.
  return (isUnnamed(kind) || isListing(kind)) && sizes.size() == 4 && header_.format.type == SampleType::u8;
}

bool NrrdReader::isChannels(const std::vector<std::int64_t>& sizes, std::size_t axis) const {
  if (sizes[axis] < 2 || sizes[axis] > kMaxChannels) return false;
  return isListing(kindOf(axis));
}

// Takes the axis away that holds the samples of a voxel, if there is one.
void NrrdReader::takeSampleAxis(std::vector<std::int64_t>& sizes) {
  end_space_axis_ = axis_count_;
  if (axis_count_ < 2) return;
  const bool color = firstAxisIsColor(sizes);
  if (color || isChannels(sizes, 0)) {
    header_.format.channels = static_cast<int>(sizes[0]);
    header_.is_color = color;
    sizes.erase(sizes.begin());
    first_space_axis_ = 1;
  } else if (isChannels(sizes, axis_count_ - 1)) {
    header_.format.channels = static_cast<int>(sizes.back());
    header_.is_color = false;
    header_.order = ArrayOrder::planes;
    sizes.pop_back();
    --end_space_axis_;
  }
}

void NrrdReader::readSizes() {
  const std::int64_t dimension = integer("dimension", require("dimension"));
  if (dimension < 1 || dimension > 4) {
    failData("{}: dimension: {} is outside 1..4", file_.name(), dimension);
  }
  std::vector<std::int64_t> sizes;
  for (const std::string_view word : words(require("sizes"))) sizes.push_back(integer("sizes", word));
  axis_count_ = static_cast<std::size_t>(dimension);
  if (sizes.size() != axis_count_) {
    failData("{}: sizes: {} are given, dimension is {}", file_.name(), sizes.size(), dimension);
  }
  takeSampleAxis(sizes);
  if (sizes.size() > 3) {
    failData(
        "{}: dimension: four axes are a volume only when the first is colour (sizes 3 or 4), or the first or the last "
        "is "
        "a list of 2 to 4 channels (kinds)",
        file_.name());
  }
  sizes.resize(3, 1);
  header_.dims = checkedDims(sizes[0], sizes[1], sizes[2], file_.name(), "sizes");
}

// "(1,0,0) none (0,1,0)"; two components are completed by 0
std::vector<std::optional<glm::dvec3>> NrrdReader::vectors(const std::string& name, std::string_view text) const {
  std::vector<std::optional<glm::dvec3>> result;
  while (!(text = trimmed(text)).empty()) {
    if (text.starts_with("none")) {
      result.emplace_back();
      text.remove_prefix(4);
      continue;
    }
    const std::size_t close = text.find(')');
    if (!text.starts_with('(') || close == std::string_view::npos) {
      failData("{}: {}: '{}' is no vector", file_.name(), name, text.substr(0, 40));
    }
    std::string inside(text.substr(1, close - 1));
    std::replace(inside.begin(), inside.end(), ',', ' ');
    const auto numbers = words(inside);
    if (numbers.size() < 2 || numbers.size() > 3) {
      failData("{}: {}: a vector has {} components; 2 or 3 can be read", file_.name(), name, numbers.size());
    }
    glm::dvec3 vector{0};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto number = parseReal(numbers[i]);
      if (!number || !std::isfinite(*number)) {
        failData("{}: {}: '{}' is no finite number", file_.name(), name, numbers[i]);
      }
      vector[static_cast<int>(i)] = *number;
    }
    result.emplace_back(vector);
    text.remove_prefix(close + 1);
  }
  return result;
}

// The step along each of the file's axes, as far as `space directions` or `spacings` give one.
std::vector<std::optional<glm::dvec3>> NrrdReader::axisSteps() const {
  if (const std::string* directions = find("space directions")) {
    auto steps = vectors("space directions", *directions);
    if (steps.size() != axis_count_) {
      failData("{}: space directions: {} are given, dimension is {}", file_.name(), steps.size(), axis_count_);
    }
    return steps;
  }
  std::vector<std::optional<glm::dvec3>> steps(axis_count_);
  const std::string* spacings = find("spacings");
  if (spacings == nullptr) return steps;
  const auto numbers = words(*spacings);
  if (numbers.size() != axis_count_) {
    failData("{}: spacings: {} are given, dimension is {}", file_.name(), numbers.size(), axis_count_);
  }
  for (std::size_t i = first_space_axis_; i < end_space_axis_; ++i) {
    const auto number = parseReal(numbers[i]);
    if (!number) failData("{}: spacings: '{}' is no number", file_.name(), numbers[i]);
    if (std::isnan(*number)) continue;  // "not known"
    glm::dvec3 step{0};
    step[static_cast<int>(i - first_space_axis_)] = *number;
    steps[i] = step;
  }
  return steps;
}

void NrrdReader::readGeometry() {
  const auto steps = axisSteps();
  Geometry& geometry = header_.geometry;
  for (std::size_t i = first_space_axis_; i < end_space_axis_; ++i) {
    if (steps[i]) geometry.axes[i - first_space_axis_] = *steps[i];
  }
  // One slice that lies obliquely: the axis that the file does not have stands upright on the two that it has.
  const glm::dvec3 normal = glm::cross(geometry.axes[0], geometry.axes[1]);
  if (end_space_axis_ - first_space_axis_ == 2 && glm::length(normal) > 0) geometry.axes[2] = glm::normalize(normal);
  if (const std::string* origin = find("space origin")) {
    const auto points = vectors("space origin", *origin);
    if (points.size() != 1) failData("{}: space origin: '{}' is not one point", file_.name(), *origin);
    geometry.first_center = points[0];
  }
}

// What is for people only: a text that is too long to be a name is left out.
void NrrdReader::readUnits() {
  const auto text = [&](const char* name) {
    const std::string* value = find(name);
    return value == nullptr || value->size() > kMaxUnitBytes ? std::string() : *value;
  };
  header_.space = text("space");
  header_.sample_unit = unquoted(text("sample units"));
  // One a world axis; or one a file axis, where those of samples have "" or ???.
  const std::string units = text(find("space units") != nullptr ? "space units" : "units");
  std::string unit;
  for (std::string_view rest = trimmed(units); !rest.empty(); rest = trimmed(rest)) {
    const std::size_t end = rest.starts_with('"') ? rest.find('"', 1) : rest.find(' ');
    const std::string own = unquoted(rest.substr(0, end == std::string_view::npos || rest[0] != '"' ? end : end + 1));
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (own.empty() || own == "???") continue;
    if (!unit.empty() && own != unit) return;
    unit = own;
  }
  header_.length_unit = unit;
}

// What our own keys say goes before the fields, which could not hold it.
void NrrdReader::readKeys() {
  const bool is_one = header_.is_color && header_.format.channels > 1;
  NrrdKeys keys = readNrrdKeys(own_, is_one ? 1 : static_cast<std::size_t>(header_.format.channels), file_.name());
  if (!keys.space.empty()) header_.space = std::move(keys.space);
  if (!keys.length_unit.empty()) header_.length_unit = std::move(keys.length_unit);
  header_.geometry.corner = keys.corner;
  header_.channels = std::move(keys.channels);
}

}  // namespace

NrrdHeader readNrrdHeader(const InputFile& file) { return NrrdReader(file).read(); }

}  // namespace blockwalk
