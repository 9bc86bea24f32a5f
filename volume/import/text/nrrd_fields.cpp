// SPDX-License-Identifier: Apache-2.0
#include "volume/import/text/nrrd_fields.h"

#include <algorithm>
#include <cmath>

#include "volume/error.h"
#include "volume/import/header_text.h"
#include "volume/import/text/data_files.h"
#include "volume/import/text/nrrd_keys.h"

namespace blockwalk {
namespace {

// One spelling for fields that have two.
std::string canonicalField(std::string name) {
  if (name == "datafile") return "data file";
  if (name == "lineskip") return "line skip";
  if (name == "byteskip") return "byte skip";
  if (name == "sampleunits") return "sample units";
  if (name == "axismins") return "axis mins";
  if (name == "axismaxs") return "axis maxs";
  if (name == "centers") return "centerings";
  return name;
}

// The rest of the header where the data files are listed: a name a line.
std::vector<std::string> restOf(HeaderLines& lines) {
  std::vector<std::string> names;
  while (const auto line = lines.next()) {
    if (!trimmed(*line).empty()) names.emplace_back(trimmed(*line));
  }
  return names;
}

}  // namespace

std::string nrrdUnquoted(std::string_view text) {
  const bool quoted = text.size() >= 2 && text.front() == '"' && text.back() == '"';
  return std::string(quoted ? text.substr(1, text.size() - 2) : text);
}

NrrdFields::NrrdFields(const InputFile& file) : name_(file.name()) {
  HeaderLines lines(file);
  const auto magic = lines.next();
  if (!magic || magic->size() != 8 || !magic->starts_with("NRRD000") || (*magic)[7] < '1' || (*magic)[7] > '5') {
    failData("{}: the first line is not NRRD0001 to NRRD0005", name_);
  }
  while (auto line = lines.next()) {
    if (line->empty()) break;
    if (line->starts_with('#')) continue;
    const std::size_t colon = line->find(':');
    if (colon == std::string_view::npos) failData("{}: header line '{}' is no field", name_, line->substr(0, 80));
    if (line->substr(colon).starts_with(":=")) {  // a key of the user's own, or of ours
      const std::string_view key = line->substr(0, colon);
      if (key.starts_with(kNrrdKeyPrefix)) own.emplace(key.substr(kNrrdKeyPrefix.size()), line->substr(colon + 2));
      continue;
    }
    const std::string field = canonicalField(lowerCase(trimmed(line->substr(0, colon))));
    const bool added = fields_.emplace(field, trimmed(line->substr(colon + 1))).second;
    if (!added) failData("{}: {}: the field stands in the header twice", name_, field);
    if (field == "data file") list_axes = axesOfList(fields_[field], name_, field);
    if (list_axes) listed = restOf(lines);
  }
  data_begin = lines.position();
}

const std::string* NrrdFields::find(const std::string& name) const {
  const auto found = fields_.find(name);
  return found == fields_.end() ? nullptr : &found->second;
}

const std::string& NrrdFields::require(const std::string& name) const {
  const std::string* value = find(name);
  if (value == nullptr) failData("{}: {}: the field is missing", name_, name);
  return *value;
}

std::int64_t NrrdFields::integer(const std::string& name, std::string_view text) const {
  const auto value = parseInteger(text);
  if (!value) failData("{}: {}: '{}' is no whole number", name_, name, text.substr(0, 40));
  return *value;
}

std::string NrrdFields::kindOf(std::size_t axis) const {
  const std::string* kinds = find("kinds");
  const auto names = words(kinds != nullptr ? std::string_view(*kinds) : std::string_view());
  return axis < names.size() ? lowerCase(names[axis]) : "";
}

std::vector<std::optional<glm::dvec3>> NrrdFields::vectors(const std::string& name, std::string_view text) const {
  std::vector<std::optional<glm::dvec3>> result;
  while (!(text = trimmed(text)).empty()) {
    if (text.starts_with("none")) {
      result.emplace_back();
      text.remove_prefix(4);
      continue;
    }
    const std::size_t close = text.find(')');
    if (!text.starts_with('(') || close == std::string_view::npos) {
      failData("{}: {}: '{}' is no vector", name_, name, text.substr(0, 40));
    }
    std::string inside(text.substr(1, close - 1));
    std::replace(inside.begin(), inside.end(), ',', ' ');
    const auto parts = words(inside);
    if (parts.size() < 2 || parts.size() > 4) {
      failData("{}: {}: a vector has {} components; 2 to 4 can be read", name_, name, parts.size());
    }
    glm::dvec4 vector{0};
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const auto number = parseReal(parts[i]);
      if (!number || !std::isfinite(*number)) {
        failData("{}: {}: '{}' is no finite number", name_, name, parts[i]);
      }
      vector[static_cast<int>(i)] = *number;
    }
    result.emplace_back(glm::dvec3(vector));
    text.remove_prefix(close + 1);
  }
  return result;
}

std::vector<std::optional<double>> NrrdFields::numbers(const std::string& name, const std::string& text) const {
  std::vector<std::optional<double>> result;
  for (const std::string_view word : words(text)) {
    const auto number = parseReal(word);
    if (!number) failData("{}: {}: '{}' is no number", name_, name, word);
    result.push_back(std::isnan(*number) ? std::nullopt : number);
  }
  return result;
}

}  // namespace blockwalk
