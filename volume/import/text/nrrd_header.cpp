// SPDX-License-Identifier: Apache-2.0
#include "volume/import/text/nrrd_header.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/formats/world_space.h"
#include "volume/import/header_text.h"
#include "volume/import/text/nrrd_fields.h"
#include "volume/import/text/nrrd_keys.h"
#include "volume/import/text/nrrd_place.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

class NrrdReader {
 public:
  NrrdReader(const InputFile& file, bool is_chosen) : file_(file), is_chosen_(is_chosen), fields_(file) {
    header_.list_axes = fields_.list_axes;
    header_.listed = fields_.listed;
    header_.data_begin = fields_.data_begin;
  }

  NrrdHeader read() {
    readEncoding();
    readType();
    readSizes();
    header_.geometry = readNrrdPlace(fields_, header_.sizes, axes_);
    header_.spacing_fields = nrrdSpacingFields(fields_);
    readUnits();
    readKeys();
    turnToTheRight();
    return header_;
  }

 private:
  void readEncoding();
  void readType();
  void readSizes();
  void readUnits();
  void readKeys();
  void turnToTheRight();
  std::int64_t sizeOf(std::size_t place) const { return header_.sizes[axes_[place]]; }
  bool firstAxisIsColor() const;
  bool isChannels(std::size_t place) const;
  bool isElsewhere(std::size_t axis) const;
  void dropAxes();
  void dropLast(std::size_t most);
  void takeSampleAxis();

  const InputFile& file_;
  bool is_chosen_;
  NrrdFields fields_;
  NrrdHeader header_;
  std::vector<std::size_t> axes_;  // the file's that are left: in the end those of space, x first
};

void NrrdReader::readEncoding() {
  const std::string encoding = lowerCase(fields_.require("encoding"));
  if (encoding == "raw") {
    header_.encoding = NrrdEncoding::raw;
  } else if (encoding == "gzip" || encoding == "gz") {
    header_.encoding = NrrdEncoding::gzip;
  } else if (encoding == "bzip2" || encoding == "bz2") {
    header_.encoding = NrrdEncoding::bzip2;
  } else if (encoding == "hex") {
    header_.encoding = NrrdEncoding::hex;
  } else if (encoding == "ascii" || encoding == "text" || encoding == "txt") {
    header_.encoding = NrrdEncoding::text;
  } else {
    failData("{}: encoding: '{}' cannot be read; raw, gzip, bzip2, ascii and hex can", file_.name(), encoding);
  }
  if (const std::string* skip = fields_.find("line skip")) {
    const std::int64_t lines = fields_.integer("line skip", *skip);
    if (lines < 0) failData("{}: line skip: {} is below 0", file_.name(), lines);
    header_.line_skip = static_cast<std::uint64_t>(lines);
  }
  if (const std::string* skip = fields_.find("byte skip")) {
    header_.byte_skip = fields_.integer("byte skip", *skip);
    if (header_.byte_skip < -1) failData("{}: byte skip: {} is below -1", file_.name(), header_.byte_skip);
  }
  if (const std::string* name = fields_.find("data file")) {
    if (name->empty()) failData("{}: data file: no name is given", file_.name());
    if (!header_.list_axes) header_.data_file = *name;
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
  const std::string name = lowerCase(fields_.require("type"));
  const auto found = kTypes.find(name);
  if (found == kTypes.end()) failData("{}: type: '{}' is not known", file_.name(), name);
  header_.format.type = found->second;

  const bool has_order = sampleBytes(header_.format.type) > 1 && header_.encoding != NrrdEncoding::text;
  if (!has_order) return;
  const std::string endian = lowerCase(fields_.require("endian"));
  if (endian != "little" && endian != "big")
    failData("{}: endian: '{}' is neither little nor big", file_.name(), endian);
  header_.format.swap_bytes = (endian == "big") != (std::endian::native == std::endian::big);
}

bool isUnnamed(std::string_view kind) { return kind.empty() || kind == "???" || kind == "none"; }

bool isListing(std::string_view kind) {
  return kind == "list" || kind == "vector" || kind == "2-vector" || kind == "3-vector" || kind == "4-vector";
}

bool NrrdReader::firstAxisIsColor() const {
  if (sizeOf(0) != 3 && sizeOf(0) != 4) return false;
  const std::string kind = fields_.kindOf(axes_[0]);
  if (kind == "rgb-color" || kind == "3-color" || kind == "hsv-color" || kind == "xyz-color") return sizeOf(0) == 3;
  if (kind == "rgba-color" || kind == "4-color") return sizeOf(0) == 4;
  // Three slices of a scalar are a volume: without a name for it, only a fourth axis makes the first one colour.
  return (isUnnamed(kind) || isListing(kind)) && axes_.size() == 4 && header_.format.type == SampleType::u8;
}

bool NrrdReader::isChannels(std::size_t place) const {
  if (sizeOf(place) < 2 || sizeOf(place) > kMaxChannels) return false;
  return isListing(fields_.kindOf(axes_[place]));
}

// Whether the header says that an axis is none of space.
bool NrrdReader::isElsewhere(std::size_t axis) const {
  const std::string kind = fields_.kindOf(axis);
  const std::string* directions = fields_.find("space directions");
  if (directions == nullptr) return isListing(kind) || kind == "time" || kind == "point" || kind == "scalar";
  const auto steps = fields_.vectors("space directions", *directions);
  return axis < steps.size() && !steps[axis];
}

// Axes of length 1 that are not of space.
void NrrdReader::dropAxes() {
  std::erase_if(axes_, [&](std::size_t axis) { return header_.sizes[axis] == 1 && isElsewhere(axis); });
  if (axes_.empty()) axes_.push_back(0);
}

// Of length 1, the last first.
void NrrdReader::dropLast(std::size_t most) {
  for (std::size_t place = axes_.size(); axes_.size() > most && place-- > 0;) {
    if (sizeOf(place) == 1) axes_.erase(axes_.begin() + static_cast<std::ptrdiff_t>(place));
  }
}

// Takes the axis away that holds the samples of a voxel, if there is one.
void NrrdReader::takeSampleAxis() {
  if (axes_.size() < 2) return;
  const bool color = firstAxisIsColor();
  if (color || isChannels(0)) {
    header_.format.channels = static_cast<int>(sizeOf(0));
    header_.is_color = color;
    axes_.erase(axes_.begin());
  } else if (!is_chosen_ && isChannels(axes_.size() - 1)) {
    header_.format.channels = static_cast<int>(sizeOf(axes_.size() - 1));
    header_.is_color = false;
    header_.order = ArrayOrder::planes;
    axes_.pop_back();
  }
}

void NrrdReader::readSizes() {
  const std::int64_t dimension = fields_.integer("dimension", fields_.require("dimension"));
  constexpr std::int64_t kMostAxes = 16;  // as Teem has it
  if (dimension < 1 || dimension > kMostAxes) {
    failData("{}: dimension: {} is outside 1..{}", file_.name(), dimension, kMostAxes);
  }
  for (const std::string_view word : words(fields_.require("sizes")))
    header_.sizes.push_back(fields_.integer("sizes", word));
  const auto axis_count = static_cast<std::size_t>(dimension);
  if (header_.sizes.size() != axis_count) {
    failData("{}: sizes: {} are given, dimension is {}", file_.name(), header_.sizes.size(), dimension);
  }
  for (const std::int64_t size : header_.sizes) {
    if (size < 1 || size > kMaxDim) failData("{}: sizes: {} is outside 1..{}", file_.name(), size, kMaxDim);
  }
  for (std::size_t axis = 0; axis < axis_count; ++axis) axes_.push_back(axis);
  dropAxes();
  dropLast(4);
  takeSampleAxis();
  // Behind one slice there may be frames of it.
  if (axes_.size() != 4 || !isElsewhere(axes_[3])) dropLast(3);
  if (axes_.size() > 4) {
    failData("{}: dimension: {} axes are longer than 1; three, one of frames and one of samples can be read",
             file_.name(), axes_.size());
  }
  if (axes_.size() == 4) {
    header_.frames = sizeOf(3);
    axes_.pop_back();
  }
  std::array<std::int64_t, 3> sides{1, 1, 1};
  for (std::size_t i = 0; i < axes_.size(); ++i) sides[i] = sizeOf(i);
  header_.dims = checkedDims(sides[0], sides[1], sides[2], file_.name(), "sizes");
}

// A left-handed world would be seen as its mirror image.
void NrrdReader::turnToTheRight() {
  const WorldSpace space = worldSpace(header_.space);
  if (space.is_left_handed) {
    Geometry& geometry = header_.geometry;
    for (glm::dvec3& axis : geometry.axes) axis.x = -axis.x;
    if (geometry.first_center) geometry.first_center->x = -geometry.first_center->x;
    if (geometry.corner) geometry.corner->x = -geometry.corner->x;
    header_.notes.push_back(fmt::format(
        "space {} is left-handed: its first axis is turned round, so that the world is {}", header_.space, space.name));
  }
  header_.space = space.name;
}

// What is for people only: a text that is too long to be a name is left out.
void NrrdReader::readUnits() {
  const auto text = [&](const char* name) {
    const std::string* value = fields_.find(name);
    return value == nullptr || value->size() > kMaxUnitBytes ? std::string() : *value;
  };
  header_.space = text("space");
  header_.sample_unit = nrrdUnquoted(text("sample units"));
  // One a world axis; or one a file axis, where those of samples have "" or ???.
  const std::string units = text(fields_.find("space units") != nullptr ? "space units" : "units");
  std::string unit;
  for (std::string_view rest = trimmed(units); !rest.empty(); rest = trimmed(rest)) {
    const std::size_t end = rest.starts_with('"') ? rest.find('"', 1) : rest.find(' ');
    const std::string own =
        nrrdUnquoted(rest.substr(0, end == std::string_view::npos || rest[0] != '"' ? end : end + 1));
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
  NrrdKeys keys =
      readNrrdKeys(fields_.own, is_one ? 1 : static_cast<std::size_t>(header_.format.channels), file_.name());
  if (!keys.space.empty()) header_.space = std::move(keys.space);
  if (!keys.length_unit.empty()) header_.length_unit = std::move(keys.length_unit);
  header_.geometry.corner = keys.corner;
  header_.channels = std::move(keys.channels);
}

}  // namespace

NrrdHeader readNrrdHeader(const InputFile& file, bool is_chosen) { return NrrdReader(file, is_chosen).read(); }

}  // namespace blockwalk
