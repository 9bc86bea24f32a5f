// SPDX-License-Identifier: Apache-2.0
#include "volume/import/idx/idx_header.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <string_view>

#include "volume/error.h"
#include "volume/import/geometry.h"
#include "volume/import/header_text.h"
#include "volume/import/part_choice.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

constexpr int kMostBlockBits = 20;
constexpr int kMostAxisBits = 16;
constexpr std::int64_t kMostBlocksPerFile = std::int64_t{1} << 24;
constexpr std::size_t kMostTemplateBytes = 256;
constexpr std::int64_t kMostTime = std::int64_t{1} << 40;

struct IdxType {
  std::string_view name;
  SampleType type;
};
constexpr IdxType kIdxTypes[] = {{"uint8", SampleType::u8},   {"int8", SampleType::i8},    {"uint16", SampleType::u16},
                                 {"int16", SampleType::i16},  {"uint32", SampleType::u32}, {"int32", SampleType::i32},
                                 {"uint64", SampleType::u64}, {"int64", SampleType::i64},  {"float32", SampleType::f32},
                                 {"float64", SampleType::f64}};

std::vector<std::string_view> splitAtCommas(std::string_view text) {
  std::vector<std::string_view> parts;
  for (std::size_t comma = text.find(','); comma != std::string_view::npos; comma = text.find(',')) {
    parts.push_back(text.substr(0, comma));
    text.remove_prefix(comma + 1);
  }
  parts.push_back(text);
  return parts;
}

class IdxReader {
 public:
  IdxReader(const InputFile& file, const ImportOptions& options) : name_(file.name()), options_(options) {
    HeaderLines lines(file);
    std::string* value = nullptr;
    while (auto line = lines.next()) {
      const std::string_view text = trimmed(line->substr(0, line->find('#')));
      if (text.empty()) continue;
      if (text.starts_with('(') && text.ends_with(')')) {
        const auto [field, is_new] = fields_.emplace(text.substr(1, text.size() - 2), "");
        if (!is_new) failData("{}: {}: the field stands in the header twice", name_, field->first.substr(0, 40));
        value = &field->second;
      } else if (value == nullptr) {
        failData("{}: header line '{}' belongs to no field", name_, text.substr(0, 80));
      } else {
        *value += fmt::format("{}{}", value->empty() ? "" : " ", text);
      }
    }
  }

  IdxHeader read() {
    const std::int64_t version = integer("version", require("version"));
    if (version != 6) failData("{}: version: {} cannot be read, 6 can", name_, version);
    if (const auto* arco = find("arco"); arco != nullptr && *arco != "0") {
      failData("{}: arco: '{}': files of a block each cannot be read", name_, arco->substr(0, 40));
    }
    if (const auto* gap = find("interleave block"); gap != nullptr && integer("interleave block", *gap) != 0) {
      failData("{}: interleave block: {} cannot be read, 0 can", name_, gap->substr(0, 40));
    }
    readBits();
    readBox();
    readFields();
    readBlocks();
    readFiles();
    readPlace();
    return std::move(header_);
  }

 private:
  const std::string* find(const std::string& field) const {
    const auto found = fields_.find(field);
    return found == fields_.end() ? nullptr : &found->second;
  }
  const std::string& require(const std::string& field) const {
    const std::string* value = find(field);
    if (value == nullptr) failData("{}: {}: the field is missing", name_, field);
    return *value;
  }
  std::int64_t integer(const std::string& field, std::string_view text) const {
    const auto value = parseInteger(text);
    if (!value) failData("{}: {}: '{}' is no whole number", name_, field, text.substr(0, 40));
    return *value;
  }
  double real(const std::string& field, std::string_view text) const {
    const auto value = parseReal(text);
    if (!value || !std::isfinite(*value))
      failData("{}: {}: '{}' is no finite number", name_, field, text.substr(0, 40));
    return *value;
  }

  void readBits();
  void readBox();
  void readFields();
  IdxField readField(std::string_view text) const;
  void readBlocks();
  void readFiles();
  void readTime(std::string& time);
  void readPlace();

  std::string name_;
  const ImportOptions& options_;
  std::map<std::string, std::string, std::less<>> fields_;
  IdxHeader header_;
};

// "V012012": the highest bit first.
void IdxReader::readBits() {
  const std::string& text = require("bits");
  if (text.size() < 2 || text[0] != 'V') failData("{}: bits: '{}' is no V with digits", name_, text.substr(0, 80));
  glm::ivec3 counts{0};
  for (std::size_t i = text.size() - 1; i > 0; --i) {
    if (text[i] < '0' || text[i] > '2')
      failData("{}: bits: '{}' names other axes than 0, 1 and 2", name_, text.substr(0, 80));
    const int axis = text[i] - '0';
    if (++counts[axis] > kMostAxisBits) failData("{}: bits: more than {} of axis {}", name_, kMostAxisBits, axis);
    header_.bits.axes.push_back(static_cast<std::uint8_t>(axis));
  }
}

// "x0 x1 y0 y1 z0 z1", the second of each with it; what is behind are axes of a single voxel.
void IdxReader::readBox() {
  const auto numbers = words(require("box"));
  if (numbers.size() < 4 || numbers.size() % 2 != 0 || numbers.size() > 10) {
    failData("{}: box: {} numbers, must be two for each of 2 to 5 axes", name_, numbers.size());
  }
  const glm::ivec3 most = header_.bits.extent(0, header_.bits.count());
  std::array<std::int64_t, 3> sides = {1, 1, 1};
  for (std::size_t axis = 0; 2 * axis < numbers.size(); ++axis) {
    const std::int64_t first = integer("box", numbers[2 * axis]);
    const std::int64_t last = integer("box", numbers[2 * axis + 1]);
    const int bound = axis < 3 ? most[static_cast<int>(axis)] : 1;
    if (first < 0 || last < first || last >= bound) {
      failData("{}: box: {}..{} along axis {} is empty or outside 0..{}, which bits have", name_, first, last, axis,
               bound - 1);
    }
    if (axis == 3) break;  // the fourth and fifth have one voxel each
    header_.first[static_cast<int>(axis)] = static_cast<int>(first);
    sides[axis] = last - first + 1;
  }
  header_.dims = checkedDims(sides[0], sides[1], sides[2], name_, "box");
}

// "name uint8[3] default_value(0) ...", joined by +.
void IdxReader::readFields() {
  std::string_view left = require("fields");
  while (!left.empty()) {
    std::size_t end = 0;
    for (int depth = 0; end < left.size() && (left[end] != '+' || depth > 0); ++end) {
      depth += left[end] == '(' ? 1 : left[end] == ')' ? -1 : 0;
    }
    if (header_.fields.size() == kMaxChannels) failData("{}: fields: more than {} cannot be read", name_, kMaxChannels);
    header_.fields.push_back(readField(trimmed(left.substr(0, end))));
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  if (header_.fields.empty()) failData("{}: fields: there are none", name_);
  const SampleFormat& format = header_.fields[0].format;
  for (const IdxField& field : header_.fields) {
    if (field.format != format || (header_.fields.size() > 1 && format.channels > 1)) {
      failData("{}: fields: '{}' and '{}' are not single values of one type", name_, header_.fields[0].name,
               field.name);
    }
  }
}

IdxField IdxReader::readField(std::string_view text) const {
  const auto items = words(text);
  if (items.size() < 2) failData("{}: fields: '{}' has no name and type", name_, text.substr(0, 80));
  IdxField field{.name = std::string(items[0].substr(0, kMaxChannelNameBytes))};
  std::string_view type = items[1];
  if (const std::size_t bracket = type.find('['); bracket != std::string_view::npos && type.ends_with(']')) {
    const std::int64_t count = integer("fields", type.substr(bracket + 1, type.size() - bracket - 2));
    if (count < 1 || count > kMaxChannels)
      failData("{}: fields: {} values a voxel, must be 1..{}", name_, count, kMaxChannels);
    field.format.channels = static_cast<int>(count);
    type = type.substr(0, bracket);
  }
  const auto* known = std::ranges::find(kIdxTypes, type, &IdxType::name);
  if (known == std::end(kIdxTypes)) failData("{}: fields: type '{}' cannot be read", name_, items[1].substr(0, 40));
  field.format.type = known->type;
  constexpr std::string_view kDefault = "default_value(";
  if (const std::size_t begin = text.find(kDefault); begin != std::string_view::npos) {
    const std::string_view rest = text.substr(begin + kDefault.size());
    const std::string_view value = trimmed(rest.substr(0, rest.find(')')));
    if (!value.empty()) field.default_value = real("fields", value);
  }
  return field;
}

void IdxReader::readBlocks() {
  const int all = header_.bits.count();
  const std::string* block_bits = find("bitsperblock");
  const std::int64_t bits = block_bits == nullptr ? 0 : integer("bitsperblock", *block_bits);
  if (bits < 0 || bits > kMostBlockBits) failData("{}: bitsperblock: {} is outside 0..{}", name_, bits, kMostBlockBits);
  header_.block_bits = std::min(all, bits == 0 ? 16 : static_cast<int>(bits));
  const std::int64_t count = integer("blocksperfile", require("blocksperfile"));
  if (count < -1 || count > kMostBlocksPerFile) {
    failData("{}: blocksperfile: {} is outside -1..{}", name_, count, kMostBlocksPerFile);
  }
  header_.blocks_per_file = count > 0 ? static_cast<std::uint64_t>(count) : header_.blocks();
}

void IdxReader::readFiles() {
  std::string time;
  readTime(time);
  const std::string& given = require("filename_template");
  if (given.empty() || given.size() > kMostTemplateBytes) {
    failData("{}: filename_template: {} bytes, must be 1..{}", name_, given.size(), kMostTemplateBytes);
  }
  for (std::size_t at = given.find('%'); at != std::string::npos; at = given.find('%', at + 1)) {
    const bool is_right = at + 3 < given.size() && given[at + 1] == '0' && given[at + 2] >= '1' &&
                          given[at + 2] <= '9' && given[at + 3] == 'x';
    if (!is_right) failData("{}: filename_template: '{}' has other places than %01x to %09x", name_, given);
  }
  const std::size_t place = given.find('%');
  if (place == std::string::npos && (!time.empty() || header_.blocks_per_file < header_.blocks())) {
    failData("{}: filename_template: '{}' has no place for the number of the block", name_, given);
  }
  header_.file_template = given;
  if (!time.empty()) header_.file_template.insert(place, time);
  const std::filesystem::path path(header_.file_template);
  if (path.is_absolute() || std::ranges::find(path, "..") != path.end()) {
    failData("{}: filename_template: '{}' must be a name inside the header's own folder", name_, header_.file_template);
  }
}

// "first last template" or "template (first,last,step) ...": the folder of the step that is meant.
void IdxReader::readTime(std::string& time) {
  const std::string* text = find("time");
  if (text == nullptr || text->empty()) return;
  const auto items = words(*text);
  std::string_view pattern = items[0];
  std::string_view first;
  std::string_view last;
  std::string_view apart = "1";
  if (items.size() > 1 && items[1].starts_with('(')) {
    const auto numbers = splitAtCommas(items[1].substr(1, items[1].find(')') - 1));
    first = numbers[0];
    last = numbers.size() > 1 ? numbers[1] : first;
    if (numbers.size() > 2) apart = numbers[2];
  } else if (items.size() == 3) {
    pattern = items[2];
    first = items[0];
    last = items[1];
  }
  const std::size_t place = pattern.find('%');
  const std::size_t end = pattern.find_first_not_of("0123456789", place + 1);
  const bool is_right = !first.empty() && place != std::string_view::npos && end != std::string_view::npos &&
                        pattern[end] == 'd' && pattern.find('%', end) == std::string_view::npos &&
                        pattern.size() <= kMostTemplateBytes;
  if (!is_right) failData("{}: time: '{}' names no first step and no folder for it", name_, text->substr(0, 80));
  const std::int64_t begin = integer("time", first);
  const std::int64_t end_step = integer("time", last);
  const std::int64_t distance = integer("time", apart);
  if (begin < 0 || end_step < begin || end_step > kMostTime || distance < 1) {
    failData("{}: time: steps {} to {}, {} apart, must ascend within 0..{}", name_, begin, end_step, distance,
             kMostTime);
  }
  const auto steps = static_cast<std::uint64_t>((end_step - begin) / distance + 1);
  const std::int64_t step =
      begin + distance * static_cast<std::int64_t>(chosenStep(options_, steps, name_, header_.notes));
  const std::string_view digits = pattern.substr(place + 1, end - place - 1);
  const std::int64_t width = digits.empty() ? 0 : integer("time", digits);
  if (width > 32) failData("{}: time: step {} with {} digits cannot be read", name_, step, width);
  const bool zeros = digits.starts_with('0');
  const std::string number = fmt::format("{}", step);
  const std::size_t padding = std::max<std::size_t>(static_cast<std::size_t>(width), number.size()) - number.size();
  time = fmt::format("{}{}{}{}", pattern.substr(0, place), std::string(padding, zeros ? '0' : ' '), number,
                     pattern.substr(end + 1));
}

// A map of the box that the bits have, or the box in the world that the voxels fill.
void IdxReader::readPlace() {
  Geometry geometry;
  glm::dvec3 corner(header_.first);
  if (const std::string* box = find("physic_box")) {
    header_.spacing_field = "physic_box";
    const auto numbers = words(*box);
    const std::size_t axes = std::min<std::size_t>(3, numbers.size() / 2);
    for (std::size_t i = 0; i < axes; ++i) {
      const double begin = real("physic_box", numbers[2 * i]);
      const int axis = static_cast<int>(i);
      geometry.axes[i] *= (real("physic_box", numbers[2 * i + 1]) - begin) / header_.dims[axis];
      corner[axis] = begin;
    }
  } else if (const std::string* map = find("logic_to_physic")) {
    header_.spacing_field = "logic_to_physic";
    const auto numbers = words(*map);
    if (numbers.size() != 16) failData("{}: logic_to_physic: {} numbers, must be 16", name_, numbers.size());
    glm::dmat4 world(1.0);
    for (int i = 0; i < 16; ++i) world[i % 4][i / 4] = real("logic_to_physic", numbers[static_cast<std::size_t>(i)]);
    if (glm::dvec4(world[0][3], world[1][3], world[2][3], world[3][3]) != glm::dvec4(0, 0, 0, 1)) {
      failData("{}: logic_to_physic: the last row is not 0 0 0 1", name_);
    }
    for (int i = 0; i < 3; ++i) geometry.axes[static_cast<std::size_t>(i)] = glm::dvec3(world[i]);
    corner = glm::dvec3(world * glm::dvec4(corner, 1));
  }
  geometry.corner = corner;
  geometry.first_center = corner + 0.5 * (geometry.axes[0] + geometry.axes[1] + geometry.axes[2]);
  header_.geometry = geometry;
}

}  // namespace

// Digits from the right to the left of the template; those that are left over are folders.
std::string IdxHeader::fileOf(std::uint64_t block, const std::string& source) const {
  std::uint64_t number = block - block % blocks_per_file;
  std::string name = file_template;
  const auto digits = [&](int count) {
    std::string text;
    for (int i = 0; i < count; ++i, number >>= 4) text.insert(text.begin(), "0123456789abcdef"[number & 15]);
    return text;
  };
  std::size_t place = name.rfind('%');
  while (place != std::string::npos) {
    const int count = name[place + 2] - '0';
    name.replace(place, 4, digits(count));
    const std::size_t before = place == 0 ? std::string::npos : name.rfind('%', place - 1);
    if (before == std::string::npos) {
      while (number != 0) name.insert(place, digits(count) + "/");
    }
    place = before;
  }
  if (number != 0) failData("{}: filename_template: has no place for block {}", source, block);
  return name;
}

IdxHeader readIdxHeader(const InputFile& file, const ImportOptions& options) { return IdxReader(file, options).read(); }

}  // namespace blockwalk
