// SPDX-License-Identifier: Apache-2.0
// What OME-Zarr says of an image: its levels, and how its channels or labels are to be shown.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "volume/import/zarr/ome_axes.h"
#include "volume/import/zarr/zarr_node.h"
#include "volume/source.h"

namespace blockwalk {

// One array to read, and what is said about it.
struct OmeImage {
  std::string key = {};            // of the array
  std::vector<OmeAxis> axes = {};  // one an axis; none where nothing is said
  std::optional<OmeMap> world_from_index = {};
  std::size_t level = 0;
  std::size_t levels = 1;
  std::vector<std::string> notes = {};  // what was chosen among several, a sentence each
  bool is_labels = false;
  nlohmann::json attributes = {};   // of the group, where omero and image-label stand
  std::string file = {};            // of those
  std::string spacing_fields = {};  // that say it; empty: none does
};

// Goes from a node (an image, its labels, a plate, a well, a list of images, a plain array) to the array that is meant.
// Throws DataError where there is none, with the names of what could be.
OmeImage findOmeImage(const ZarrStore& store, const std::string& key, std::optional<int> level);

// Of the image that the store itself is, if it is one: the level whose array has that key.
std::optional<int> omeLevelAt(const ZarrStore& store, const std::string& key);

// Names, colours and windows of channels, or names and colours of labels, as far as they are said. Returns what must be
// told about that.
std::vector<std::string> describeOmeChannels(const OmeImage& image, std::vector<SourceChannel>& channels);

}  // namespace blockwalk
