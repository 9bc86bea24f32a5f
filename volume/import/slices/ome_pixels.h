// SPDX-License-Identifier: Apache-2.0
// One Pixels element of OME-XML, and which page of which file each of its planes is.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "volume/formats/time_step.h"
#include "volume/import/import.h"
#include "volume/import/slices/tiff_description.h"

namespace blockwalk {

// The name of an element without the prefix of its namespace.
std::string_view omeLocalName(const pugi::xml_node& node);

class OmePixels {
 public:
  OmePixels(std::string source, const pugi::xml_node& pixels) : source_(std::move(source)), pixels_(pixels) {}

  // SizeZ and so on, at least 1: `absent` where the attribute is missing.
  std::int64_t size(const char* attribute, std::int64_t absent = 1) const;
  bool has(const char* attribute) const { return static_cast<bool>(pixels_.attribute(attribute)); }
  std::string_view dimensionOrder() const { return pixels_.attribute("DimensionOrder").as_string("XYCZT"); }
  std::vector<pugi::xml_node> children(std::string_view name) const;
  // PhysicalSizeX and so on; nothing where the attribute is missing.
  std::optional<double> physicalSize(const std::string& attribute) const;
  // As OME has it, micrometres where nothing is said.
  std::string unit(const std::string& attribute) const {
    return pixels_.attribute(attribute.c_str()).as_string("\xc2\xb5m");
  }
  // TimeIncrement with its unit, seconds where nothing is said; empty where it is missing.
  std::string timeStep() const {
    return timeStepText(pixels_.attribute("TimeIncrement").as_double(),
                        pixels_.attribute("TimeIncrementUnit").as_string("s"));
  }

 private:
  std::string source_;
  pugi::xml_node pixels_;
};

// Fills channels, pages, files and notes. `images`: how many there are in the file; the pages of others are passed
// over.
void orderOmePages(const TiffFile& file, const std::filesystem::path& path, const OmePixels& pixels, std::size_t images,
                   const ImportOptions& options, TiffDescription& description);

}  // namespace blockwalk
