// SPDX-License-Identifier: Apache-2.0
// What a TIFF file says of its pages, by the tags alone or as ImageJ and OME-TIFF say it in ImageDescription: which
// slice and channel each page is, how large voxels are, and what the channels are called and look like.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "volume/import/import.h"
#include "volume/import/slices/tiff_file.h"

namespace blockwalk {

// A page of one of the files.
struct PageAt {
  static constexpr std::uint32_t kBlank = UINT32_MAX;
  std::uint32_t file = kBlank;  // kBlank: nothing was written there
  std::uint32_t page = 0;
};

// What is not said is left out.
struct TiffDescription {
  std::size_t channels = 1;        // pages a slice
  std::vector<PageAt> pages = {};  // of the frame that is meant: slice after slice, of each channel after channel
  std::int64_t planes = 0;         // not 0: see TiffFile::takePlanes()
  std::vector<std::filesystem::path> files = {};  // of a set; none: it is the one file
  std::vector<std::string> channel_names = {};    // none, or one each
  std::vector<std::optional<std::array<std::uint8_t, 3>>> channel_colors = {};
  std::optional<glm::dvec3> spacing = std::nullopt;  // of voxels, in `length_unit`
  std::string spacing_field = {};                    // that says it
  bool is_depth_guessed = false;                     // it does not say how far apart slices are
  std::optional<glm::dvec3> corner = std::nullopt;   // of the first voxel, in the world
  std::string length_unit = {};
  double value_scale = 1;  // of single values: data units = offset + scale * sample
  double value_offset = 0;
  std::string value_unit = {};
  std::string time_step = {};
  std::vector<std::string> notes = {};
  std::string spacing_from = {};  // for people: the fields that are there; empty: none is

  std::size_t slices() const { return pages.size() / channels; }
};

// Without a description that says otherwise pages are slices. Throws DataError where the options choose no frame of
// several, for more than kMaxChannels channels, for a number of pages that is not what the description says, and for
// sizes of voxels that are no positive numbers. Takes the planes of ImageJ's large files.
TiffDescription describePages(TiffFile& file, const std::filesystem::path& path, const ImportOptions& options);

// What one description says; nothing where the text is no such thing.
std::optional<TiffDescription> describeImageJ(TiffFile& file, std::string_view text, const ImportOptions& options);
std::optional<TiffDescription> describeOme(const TiffFile& file, const std::filesystem::path& path,
                                           std::string_view text, const ImportOptions& options);

}  // namespace blockwalk
