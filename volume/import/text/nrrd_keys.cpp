// SPDX-License-Identifier: Apache-2.0
#include "volume/import/text/nrrd_keys.h"

#include <charconv>
#include <cmath>
#include <optional>

#include "volume/error.h"
#include "volume/import/header_text.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

class KeyReader {
 public:
  KeyReader(const std::map<std::string, std::string>& keys, const std::string& source) : keys_(keys), source_(source) {}

  // Backslashes stand twice.
  std::string text(const std::string& key) const {
    const std::string* value = find(key);
    if (value == nullptr) return {};
    if (value->size() > 2 * kMaxNameBytes) fail(key, fmt::format("{} bytes are too long", value->size()));
    std::string result;
    for (std::size_t i = 0; i < value->size(); ++i) {
      if ((*value)[i] == '\\' && i + 1 < value->size()) ++i;
      result += (*value)[i];
    }
    if (result.size() > kMaxNameBytes)
      fail(key, fmt::format("{} bytes are more than {}", result.size(), kMaxNameBytes));
    return result;
  }
  double number(const std::string& key, double absent) const {
    const std::string* value = find(key);
    return value == nullptr ? absent : finite(key, *value);
  }
  std::optional<glm::dvec3> vector(const std::string& key) const {
    const std::string* value = find(key);
    if (value == nullptr) return std::nullopt;
    const auto numbers = words(*value);
    if (numbers.size() != 3) fail(key, fmt::format("{} numbers, must be 3", numbers.size()));
    glm::dvec3 result{0};
    for (int i = 0; i < 3; ++i) result[i] = finite(key, numbers[static_cast<std::size_t>(i)]);
    return result;
  }
  std::optional<Color> color(const std::string& key) const {
    const std::string* value = find(key);
    if (value == nullptr) return std::nullopt;
    unsigned bits = 0;
    const auto [end, failure] = std::from_chars(value->data(), value->data() + value->size(), bits, 16);
    if (value->size() != 6 || failure != std::errc{} || end != value->data() + 6) {
      fail(key, fmt::format("'{}' is not rrggbb", value->substr(0, 40)));
    }
    return Color{static_cast<std::uint8_t>(bits >> 16), static_cast<std::uint8_t>(bits >> 8),
                 static_cast<std::uint8_t>(bits)};
  }

 private:
  double finite(const std::string& key, std::string_view text) const {
    const auto number = parseReal(text);
    if (!number || !std::isfinite(*number)) fail(key, fmt::format("'{}' is no finite number", text.substr(0, 40)));
    return *number;
  }
  const std::string* find(const std::string& key) const {
    const auto found = keys_.find(key);
    return found == keys_.end() ? nullptr : &found->second;
  }
  [[noreturn]] void fail(const std::string& key, const std::string& detail) const {
    failData("{}: {}{}: {}", source_, kNrrdKeyPrefix, key, detail);
  }

  const std::map<std::string, std::string>& keys_;
  const std::string& source_;
};

}  // namespace

NrrdKeys readNrrdKeys(const std::map<std::string, std::string>& keys, std::size_t channels, const std::string& source) {
  const KeyReader reader(keys, source);
  NrrdKeys result{.space = reader.text("space"),
                  .length_unit = reader.text("length_unit"),
                  .corner = reader.vector("corner"),
                  .channels = {}};
  for (std::size_t i = 0; i < channels; ++i) {
    const std::string prefix = fmt::format("channel.{}.", i);
    result.channels.push_back({.name = reader.text(prefix + "name"),
                               .value_scale = reader.number(prefix + "value_scale", 1),
                               .value_offset = reader.number(prefix + "value_offset", 0),
                               .unit = reader.text(prefix + "unit"),
                               .color = reader.color(prefix + "color")});
  }
  return result;
}

}  // namespace blockwalk
