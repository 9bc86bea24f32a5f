// SPDX-License-Identifier: Apache-2.0
// What ImageJ and OME-TIFF say in ImageDescription: which slice and channel each page is, how large voxels are, and
// what the channels are called and look like.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "volume/import/slices/tiff_file.h"

namespace blockwalk {

struct PageOrder {
  std::size_t channels = 1;      // pages a slice
  bool channels_fastest = true;  // else all slices of a channel follow each other

  std::size_t page(std::size_t slice, std::size_t channel, std::size_t slices) const {
    return channels_fastest ? slice * channels + channel : channel * slices + slice;
  }
};

// What is not said is left out.
struct TiffDescription {
  PageOrder order = {};
  std::vector<std::string> channel_names = {};  // none, or one each
  std::vector<std::optional<std::array<std::uint8_t, 3>>> channel_colors = {};
  std::optional<glm::dvec3> spacing = std::nullopt;  // of voxels, in `length_unit`
  std::string length_unit = {};
};

// Without a description that says otherwise pages are slices. Throws DataError for a series in time, for more than
// kMaxChannels channels, for a number of pages that is not what the description says, and for sizes of voxels that are
// no positive numbers.
TiffDescription describePages(const TiffFile& file);

}  // namespace blockwalk
