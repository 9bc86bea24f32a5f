// SPDX-License-Identifier: Apache-2.0
// The fields of a MetaImage header as they stand, and the kinds of values that they have.
#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "volume/error.h"
#include "volume/import/header_text.h"
#include "volume/import/text/data_files.h"

namespace blockwalk {

class MetaHeader {
 public:
  // Reads up to and with ElementDataFile, which is the last line, but for a list of files.
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
    if (find("ElementDataFile") == nullptr) failData("{}: ElementDataFile: the field is missing", name_);
    list_axes_ = axesOfList(*find("ElementDataFile"), name_, "ElementDataFile");
    while (list_axes_) {
      const auto line = lines.next();
      if (!line) break;
      if (!trimmed(*line).empty()) listed_.emplace_back(trimmed(*line));
    }
    data_begin_ = lines.position();
  }

  const std::string& name() const { return name_; }
  std::uint64_t dataBegin() const { return data_begin_; }
  // Where the data files are listed behind the header: see axesOfList(), and their names.
  const std::optional<int>& listAxes() const { return list_axes_; }
  const std::vector<std::string>& listed() const { return listed_; }

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
  std::vector<std::int64_t> integers(const std::string& key) const {
    std::vector<std::int64_t> result;
    for (const std::string_view word : words(require(key))) {
      const auto value = parseInteger(word);
      if (!value) failData("{}: {}: '{}' is no whole number", name_, key, word);
      result.push_back(*value);
    }
    return result;
  }
  double real(const std::string& key, double absent) const {
    const std::string* text = find(key);
    return text == nullptr ? absent : reals(key, *text, 1)[0];
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
  std::optional<int> list_axes_;
  std::vector<std::string> listed_;
};

}  // namespace blockwalk
