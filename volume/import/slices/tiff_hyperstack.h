// SPDX-License-Identifier: Apache-2.0
// Which slice and channel each page of a TIFF file is, as ImageJ and OME-TIFF say it in ImageDescription.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "volume/import/slices/tiff_file.h"

namespace blockwalk {

struct PageOrder {
  std::size_t channels = 1;        // pages a slice
  bool channels_fastest = true;    // else all slices of a channel follow each other
  std::vector<std::string> names;  // of the channels; none, or one each

  std::size_t page(std::size_t slice, std::size_t channel, std::size_t slices) const {
    return channels_fastest ? slice * channels + channel : channel * slices + slice;
  }
};

// Without a description that says otherwise pages are slices. Throws DataError for a series in time, for more than
// kMaxChannels channels and for a number of pages that is not what the description says.
PageOrder pageOrder(const TiffFile& file);

}  // namespace blockwalk
