// SPDX-License-Identifier: Apache-2.0
#include "volume/import/hdf5/hdf5_object.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace blockwalk {
namespace {

// Not-a-number and infinity are no JSON: they come as null.
double numberFrom(const nlohmann::json& said) {
  return said.is_null() ? std::numeric_limits<double>::quiet_NaN() : said.get<double>();
}

Hdf5Array arrayFrom(const nlohmann::json& said) {
  Hdf5Array array;
  array.shape = said.at("shape").get<std::vector<std::uint64_t>>();
  array.type = said.at("type").get<std::string>();
  if (const int sample = said.at("sample").get<int>(); sample >= 0) {
    array.format = {.type = static_cast<SampleType>(std::min(sample, static_cast<int>(SampleType::f64))),
                    .swap_bytes = said.at("swap").get<bool>()};
  }
  array.is_enum = said.at("enum").get<bool>();
  array.layout = static_cast<Hdf5Layout>(std::clamp(said.at("layout").get<int>(), 0, 4));
  array.chunk = said.at("chunk").get<std::vector<std::uint64_t>>();
  array.packs_edges = said.at("packs_edges").get<bool>();
  for (const nlohmann::json& filter : said.at("filters")) {
    array.filters.push_back({.id = filter.at("id").get<std::uint32_t>(),
                             .name = filter.at("name").get<std::string>(),
                             .values = filter.at("values").get<std::vector<std::uint32_t>>()});
  }
  for (const nlohmann::json& byte : said.at("fill")) array.fill.push_back(std::byte{byte.get<std::uint8_t>()});
  if (array.format) array.fill.resize(sampleBytes(array.format->type));
  if (said.contains("offset")) array.offset = said.at("offset").get<std::uint64_t>();
  return array;
}

}  // namespace

std::string Hdf5Array::described() const { return fmt::format("{} {}", fmt::join(shape, " x "), type); }

bool Hdf5Object::has(std::string_view member) const { return std::ranges::find(members, member) != members.end(); }

std::vector<std::string> Hdf5Object::texts(const std::string& name) const {
  std::vector<std::string> result;
  if (!attributes.contains(name)) return result;
  for (const nlohmann::json& element : attributes.at(name)) {
    if (element.is_string()) result.push_back(element.get<std::string>());
  }
  return result;
}

std::optional<std::string> Hdf5Object::text(const std::string& name) const {
  const std::vector<std::string> all = texts(name);
  if (all.empty()) return std::nullopt;
  return all.front();
}

std::vector<double> Hdf5Object::numbers(const std::string& name) const {
  std::vector<double> result;
  if (!attributes.contains(name)) return result;
  for (const nlohmann::json& element : attributes.at(name)) {
    if (element.is_number() || element.is_null()) result.push_back(numberFrom(element));
  }
  return result;
}

std::optional<double> Hdf5Object::number(const std::string& name) const {
  const std::vector<double> all = numbers(name);
  if (all.size() != 1) return std::nullopt;
  return all.front();
}

std::string Hdf5Object::joined(const std::string& name) const { return fmt::format("{}", fmt::join(texts(name), "")); }

Hdf5Object hdf5ObjectFrom(const nlohmann::json& said) {
  Hdf5Object object{.path = said.at("path").get<std::string>(), .attributes = said.at("attributes")};
  object.members = said.at("members").get<std::vector<std::string>>();
  if (said.contains("array")) object.array = arrayFrom(said.at("array"));
  return object;
}

std::string hdf5Path(std::string_view group, std::string_view member) {
  return group.empty() ? std::string(member) : fmt::format("{}/{}", group, member);
}

}  // namespace blockwalk
