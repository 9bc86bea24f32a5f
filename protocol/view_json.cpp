// SPDX-License-Identifier: Apache-2.0
#include "protocol/view_json.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "protocol/view_fields.h"
#include "protocol/view_values.h"

namespace blockwalk {
namespace {

using nlohmann::json;

std::string scalarText(const std::string& name, const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_integer())
    return value.is_number_unsigned() ? std::to_string(value.get<std::uint64_t>())
                                      : std::to_string(value.get<std::int64_t>());
  if (value.is_number_float()) return numberText(value.get<double>());
  if (value.is_boolean()) return value.get<bool>() ? "on" : "off";
  failValue(name, "must be a number, a string, true, false or an array of those", value.type_name());
}

char separatorOf(std::string_view name) {
  if (name == "size") return 'x';
  if (name == "range") return ':';
  return ',';
}

// Members of an array by their text forms.
std::string joined(const std::string& name, const json& array, char separator) {
  std::string text;
  for (std::size_t i = 0; i < array.size(); ++i) {
    if (i > 0) text += separator;
    text += scalarText(name, array[i]);
  }
  return text;
}

// Whether an element of a range or tf is a channel's whole range or transfer function and not a bound or a point.
bool isChannelItem(const std::string& name, const json& element) {
  if (name != "range" && name != "tf") return false;
  if (element.is_array() || element.is_null()) return true;
  if (!element.is_string()) return false;
  const auto& text = element.get_ref<const std::string&>();
  const bool pair = text.find(':') != std::string::npos;
  return name == "range" ? pair : !pair || text.find(',') != std::string::npos;
}

// An array's text form; planes are arrays in an array, and none of them is `none`; ranges and transfer functions may be
// one a channel, and null is the default.
std::string arrayText(const std::string& name, const json& array) {
  const bool channels = std::any_of(array.begin(), array.end(), [&](const json& e) { return isChannelItem(name, e); });
  const bool nests = name == "planes" || channels;
  if (!nests) return joined(name, array, separatorOf(name));
  if (array.empty()) return "none";
  std::string text;
  for (std::size_t i = 0; i < array.size(); ++i) {
    if (i > 0) text += ';';
    if (array[i].is_array()) {
      text += joined(name, array[i], channels ? separatorOf(name) : ',');
    } else {
      text += channels && array[i].is_null() ? "auto" : scalarText(name, array[i]);
    }
  }
  return text;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> viewFieldTexts(const json& object,
                                                                std::span<const std::string_view> skip) {
  if (!object.is_object()) failValue("view", "must be a JSON object", object.type_name());
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const auto& [name, value] : object.items()) {
    if (std::find(skip.begin(), skip.end(), name) != skip.end()) continue;
    pairs.emplace_back(name, value.is_array() ? arrayText(name, value) : scalarText(name, value));
  }
  return pairs;
}

void setViewFields(ImageRequest& request, const json& object, std::span<const std::string_view> skip) {
  setViewFields(request, viewFieldTexts(object, skip));
}

}  // namespace blockwalk
