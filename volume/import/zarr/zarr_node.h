// SPDX-License-Identifier: Apache-2.0
// A group or an array of a Zarr hierarchy, of version 2 or 3: its metadata and attributes as they stand there.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "volume/import/zarr/zarr_json.h"

namespace blockwalk {

struct ZarrNode {
  std::string key;
  int version = 2;
  bool is_array = false;
  nlohmann::json metadata = {};  // zarr.json, .zarray or .zgroup
  nlohmann::json attributes = nlohmann::json::object();

  std::string metadataFile() const;
  std::string attributesFile() const;
  ZarrField metadataField() const { return {metadata, metadataFile()}; }
  ZarrField attributesField() const { return {attributes, attributesFile()}; }
};

// Nothing where the key has no metadata of a node. Throws DataError for what is no JSON and for other versions.
std::optional<ZarrNode> readZarrNode(const ZarrStore& store, const std::string& key);

}  // namespace blockwalk
