// SPDX-License-Identifier: Apache-2.0
#include "volume/import/zarr/zarr_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "volume/error.h"

namespace blockwalk {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxZarrDepth = 64;
constexpr std::size_t kMaxZarrValues = std::size_t{1} << 20;
constexpr std::size_t kShownJsonBytes = 60;
constexpr std::uint64_t kLargestSize = std::uint64_t{1} << 53;

// How deep brackets are nested outside of texts, whether they match or not.
std::size_t nesting(std::string_view text) {
  std::size_t depth = 0;
  std::size_t deepest = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char letter = text[i];
    if (quoted) {
      if (letter == '\\') ++i;
      quoted = letter != '"';
    } else if (letter == '"') {
      quoted = true;
    } else if (letter == '{' || letter == '[') {
      deepest = std::max(deepest, ++depth);
    } else if ((letter == '}' || letter == ']') && depth > 0) {
      --depth;
    }
  }
  return deepest;
}

// JSON has no word for what is no number; programs in Python write these, which become null.
std::string withoutNan(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::size_t taken = 0;
    for (const std::string_view word : {"NaN", "Infinity", "-Infinity"}) {
      if (!quoted && text.substr(i).starts_with(word)) taken = word.size();
    }
    if (taken > 0) {
      result += "null";
      i += taken - 1;
      continue;
    }
    if (text[i] == '"') quoted = !quoted;
    result += text[i];
    if (quoted && text[i] == '\\' && i + 1 < text.size()) result += text[++i];
  }
  return result;
}

std::string shown(const Json& value) {
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > kShownJsonBytes) text = text.substr(0, kShownJsonBytes) + "...";
  return text;
}

}  // namespace

std::optional<Json> readZarrJson(const ZarrStore& store, const std::string& key) {
  const auto object = store.open(key);
  if (!object) return std::nullopt;
  if (object->bytes() > kMaxZarrTextBytes) {
    failData("{}: has {} bytes, metadata must have at most {}", key, object->bytes(), kMaxZarrTextBytes);
  }
  std::string text(object->bytes(), '\0');
  object->read(0, std::as_writable_bytes(std::span(text)));
  if (const std::size_t depth = nesting(text); depth > kMaxZarrDepth) {
    failData("{}: is nested {} times, must be at most {}", key, depth, kMaxZarrDepth);
  }
  std::size_t values = 0;
  const auto keep = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::key) return depth != 1 || parsed != "consolidated_metadata";
    const bool begins = event != Json::parse_event_t::object_end && event != Json::parse_event_t::array_end;
    if (begins && ++values > kMaxZarrValues) failData("{}: has more than {} values", key, kMaxZarrValues);
    return true;
  };
  try {
    return Json::parse(withoutNan(text), keep);
  } catch (const Json::exception& error) {
    failData("{}: is no JSON: {}", key, error.what());
  }
}

void ZarrField::fail(const std::string& detail) const {
  failData("{}: {} is {}: {}", file_, path_.empty() ? "all" : path_, shown(*value_), detail);
}

bool ZarrField::isObject() const { return value_->is_object(); }

std::optional<ZarrField> ZarrField::find(const char* key) const {
  if (!value_->is_object()) fail("must be an object");
  const auto found = value_->find(key);
  if (found == value_->end() || found->is_null()) return std::nullopt;
  return ZarrField(*found, file_, path_.empty() ? key : path_ + "." + key);
}

ZarrField ZarrField::get(const char* key) const {
  auto found = find(key);
  if (!found) fail(fmt::format("lacks {}", key));
  return *found;
}

std::string ZarrField::text() const {
  if (!value_->is_string()) fail("must be a text");
  return value_->get<std::string>();
}

double ZarrField::number() const {
  if (!value_->is_number() || !std::isfinite(value_->get<double>())) fail("must be a finite number");
  return value_->get<double>();
}

bool ZarrField::boolean() const {
  if (!value_->is_boolean()) fail("must be true or false");
  return value_->get<bool>();
}

std::int64_t ZarrField::integer() const {
  if (value_->is_number_integer()) return value_->get<std::int64_t>();
  const double value = number();
  if (value != std::floor(value) || std::fabs(value) > static_cast<double>(kLargestSize)) fail("must be whole");
  return static_cast<std::int64_t>(value);
}

std::vector<ZarrField> ZarrField::elements() const {
  if (!value_->is_array()) fail("must be a list");
  std::vector<ZarrField> result;
  for (const Json& element : *value_) result.emplace_back(element, file_, fmt::format("{}[{}]", path_, result.size()));
  return result;
}

std::vector<std::string> ZarrField::texts() const {
  std::vector<std::string> result;
  for (const ZarrField& element : elements()) result.push_back(element.text());
  return result;
}

std::vector<std::uint64_t> ZarrField::sizes(std::uint64_t least) const {
  if (!value_->is_array() || value_->empty() || value_->size() > kMaxZarrRank) {
    fail(fmt::format("must be a list of 1..{} sizes", kMaxZarrRank));
  }
  std::vector<std::uint64_t> result;
  for (const ZarrField& element : elements()) {
    const std::int64_t size = element.integer();
    if (size < 0 || static_cast<std::uint64_t>(size) < least || static_cast<std::uint64_t>(size) > kLargestSize) {
      element.fail(fmt::format("must be {}..{}", least, kLargestSize));
    }
    result.push_back(static_cast<std::uint64_t>(size));
  }
  return result;
}

}  // namespace blockwalk
