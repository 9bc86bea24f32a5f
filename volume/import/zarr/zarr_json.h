// SPDX-License-Identifier: Apache-2.0
// Metadata of Zarr: JSON, with its size, depth and number of values bounded before anything is built of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "volume/import/zarr/zarr_store.h"

namespace blockwalk {

constexpr std::uint64_t kMaxZarrTextBytes = std::uint64_t{16} << 20;
constexpr std::size_t kMaxZarrRank = 8;

// The object's text, parsed; nothing where there is none. What metadata of other nodes it repeats ("consolidated") is
// left out. Throws DataError that names the key and the bound.
std::optional<nlohmann::json> readZarrJson(const ZarrStore& store, const std::string& key);

// A value inside a file of metadata, with the way to it, for messages.
class ZarrField {
 public:
  ZarrField(const nlohmann::json& value, std::string file, std::string path = {})
      : value_(&value), file_(std::move(file)), path_(std::move(path)) {}

  const nlohmann::json& value() const { return *value_; }
  const std::string& file() const { return file_; }
  const std::string& path() const { return path_; }
  [[noreturn]] void fail(const std::string& detail) const;

  // Null counts as absent.
  std::optional<ZarrField> find(const char* key) const;
  ZarrField get(const char* key) const;
  bool isObject() const;

  std::string text() const;
  double number() const;  // finite
  bool boolean() const;
  std::int64_t integer() const;
  std::vector<ZarrField> elements() const;
  std::vector<std::string> texts() const;
  // 1..kMaxZarrRank whole numbers of `least` and more, below 2^53
  std::vector<std::uint64_t> sizes(std::uint64_t least) const;

 private:
  const nlohmann::json* value_;  // outlives it
  std::string file_;
  std::string path_;
};

}  // namespace blockwalk
