// SPDX-License-Identifier: Apache-2.0
#include "volume/import/zarr/zarr_node.h"

namespace blockwalk {
namespace {

std::optional<ZarrNode> readVersion3(const ZarrStore& store, const std::string& key) {
  auto metadata = readZarrJson(store, joinKeys(key, "zarr.json"));
  if (!metadata) return std::nullopt;
  ZarrNode node{.key = key, .version = 3, .metadata = std::move(*metadata)};
  const ZarrField field = node.metadataField();
  const ZarrField version = field.get("zarr_format");
  if (version.integer() != 3) version.fail("must be 3");
  const ZarrField type = field.get("node_type");
  if (type.text() != "array" && type.text() != "group") type.fail("must be array or group");
  node.is_array = type.text() == "array";
  if (const auto attributes = field.find("attributes")) {
    if (!attributes->isObject()) attributes->fail("must be an object");
    node.attributes = attributes->value();
  }
  return node;
}

// A group's file may be missing where attributes say enough: some writers leave it out.
std::optional<ZarrNode> readVersion2(const ZarrStore& store, const std::string& key) {
  ZarrNode node{.key = key};
  if (auto array = readZarrJson(store, joinKeys(key, ".zarray"))) {
    node.is_array = true;
    node.metadata = std::move(*array);
  } else if (auto group = readZarrJson(store, joinKeys(key, ".zgroup"))) {
    node.metadata = std::move(*group);
  }
  auto attributes = readZarrJson(store, joinKeys(key, ".zattrs"));
  if (node.metadata.is_null() && !attributes) return std::nullopt;
  if (!node.metadata.is_null()) {
    const ZarrField version = node.metadataField().get("zarr_format");
    if (version.integer() != 2) version.fail("must be 2");
  }
  if (attributes) node.attributes = std::move(*attributes);
  if (!node.attributes.is_object()) node.attributesField().fail("must be an object");
  return node;
}

}  // namespace

std::string ZarrNode::metadataFile() const {
  return joinKeys(key, version == 3 ? "zarr.json" : is_array ? ".zarray" : ".zgroup");
}

std::string ZarrNode::attributesFile() const { return joinKeys(key, version == 3 ? "zarr.json" : ".zattrs"); }

std::optional<ZarrNode> readZarrNode(const ZarrStore& store, const std::string& key) {
  auto node = readVersion3(store, key);
  return node ? std::move(node) : readVersion2(store, key);
}

}  // namespace blockwalk
