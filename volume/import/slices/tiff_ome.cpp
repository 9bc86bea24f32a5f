// SPDX-License-Identifier: Apache-2.0
// What OME-TIFF writes into ImageDescription: OME-XML (docs.openmicroscopy.org/ome-model, OME-TIFF specification).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <pugixml.hpp>
#include <string_view>

#include "volume/error.h"
#include "volume/formats/length_unit.h"
#include "volume/import/frame.h"
#include "volume/import/header_text.h"
#include "volume/import/slices/ome_pixels.h"
#include "volume/import/slices/tiff_description.h"
#include "volume/import/slices/tiff_page.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

// The size of a voxel in the unit of its x side. Nothing where x has none, or where a unit cannot be expressed in x's.
// What is not said of the others is as along x, which is told of slices.
void describeOmeSize(const OmePixels& pixels, TiffDescription& description) {
  std::array<std::optional<double>, 3> sizes;
  std::array<LengthUnit, 3> units;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string attribute = std::string("PhysicalSize") + "XYZ"[axis];
    sizes[axis] = pixels.physicalSize(attribute);
    units[axis] = lengthUnit(pixels.unit(attribute + "Unit"));
  }
  if (!sizes[0] || (!sizes[1] && sizes[2])) return;
  for (const std::size_t axis : {1, 2}) {
    if (sizes[axis]) continue;
    sizes[axis] = sizes[0];
    units[axis] = units[0];
    if (axis == 2 && description.slices() > 1) {
      description.notes.emplace_back(
          "PhysicalSizeZ is not said: slices are taken to be as far apart as pixels along x");
    }
  }
  glm::dvec3 spacing(0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double factor = factorBetween(units[axis], units[0]);
    if (!std::isfinite(factor) || factor <= 0) return;
    spacing[static_cast<int>(axis)] = *sizes[axis] * factor;
  }
  description.spacing = spacing;
  description.spacing_field = "PhysicalSize";
  description.spacing_from = pixels.has("PhysicalSizeY") ? "PhysicalSizeX, PhysicalSizeY" : "PhysicalSizeX";
  if (pixels.has("PhysicalSizeZ")) {
    description.spacing_from += ", PhysicalSizeZ";
  } else if (description.slices() > 1) {
    description.spacing_from += ", between slices guessed: as along x";
  }
  description.length_unit = units[0].name;
}

// Names and colours of the Channel elements. A name is taken where every channel has one.
void describeOmeChannels(const OmePixels& pixels, TiffDescription& description) {
  for (const pugi::xml_node& channel : pixels.children("Channel")) {
    if (description.channel_colors.size() == kMaxChannels) return;
    description.channel_names.emplace_back(channel.attribute("Name").value());
    // Red, green, blue and opacity from the highest byte of a signed 32-bit number down.
    const auto color = parseInteger(channel.attribute("Color").value());
    const bool is_color = color && *color >= INT32_MIN && *color <= INT32_MAX;
    const auto bits = static_cast<std::uint32_t>(color.value_or(0));
    description.channel_colors.push_back(is_color ? std::optional(std::array{static_cast<std::uint8_t>(bits >> 24),
                                                                             static_cast<std::uint8_t>(bits >> 16),
                                                                             static_cast<std::uint8_t>(bits >> 8)})
                                                  : std::nullopt);
  }
  if (std::ranges::any_of(description.channel_names, &std::string::empty)) description.channel_names.clear();
}

// The file beside this one that has the metadata of a set, where this one names it alone.
std::optional<std::string> companionOf(const pugi::xml_document& document, const std::filesystem::path& path,
                                       const std::string& source) {
  const pugi::xml_node only =
      document.find_node([](const pugi::xml_node& node) { return omeLocalName(node) == "BinaryOnly"; });
  if (!only) return std::nullopt;
  const std::string name = only.attribute("MetadataFile").value();
  if (name.empty() || std::filesystem::path(name).filename() != name) {
    failData("{}: ImageDescription: BinaryOnly: MetadataFile=\"{}\" is no file beside it", source, name);
  }
  const InputFile file(std::filesystem::absolute(path).parent_path() / name);
  if (file.bytes() > kMaxDescriptionBytes) {
    failData("{}: it has {} bytes, at most {} of OME-XML can be read", name, file.bytes(), kMaxDescriptionBytes);
  }
  std::string text(file.bytes(), '\0');
  file.read(0, std::as_writable_bytes(std::span(text)));
  return text;
}

// Returns whether the text is OME-XML.
bool parseOme(pugi::xml_document& document, std::string_view text, const std::string& source) {
  const std::string_view content = trimmed(text.starts_with("\xef\xbb\xbf") ? text.substr(3) : text);
  if (!content.starts_with('<') || content.find("OME") == std::string_view::npos) return false;
  const pugi::xml_parse_result parsed =
      document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed) {
    failData("{}: ImageDescription: its XML is broken at byte {}: {}", source, parsed.offset, parsed.description());
  }
  return omeLocalName(document.document_element()) == "OME";
}

}  // namespace

std::optional<TiffDescription> describeOme(const TiffFile& file, const std::filesystem::path& path,
                                           std::string_view text, const ImportOptions& options) {
  pugi::xml_document document;
  if (!parseOme(document, text, file.name())) return std::nullopt;
  if (const auto companion = companionOf(document, path, file.name())) {
    document.reset();
    if (!parseOme(document, *companion, file.name())) failData("{}: its metadata file is no OME-XML", file.name());
  }
  std::vector<pugi::xml_node> all;
  document.find_node([&](const pugi::xml_node& node) {
    if (omeLocalName(node) == "Pixels") all.push_back(node);
    return false;
  });
  if (all.empty()) failData("{}: ImageDescription: its OME-XML has no Pixels", file.name());
  const OmePixels pixels(file.name(), all.front());
  TiffDescription description;
  if (all.size() > 1) {
    description.notes.push_back(fmt::format("the file holds {} images; the first of them is read", all.size()));
  }
  orderOmePages(file, path, pixels, all.size(), options, description);
  describeOmeSize(pixels, description);
  describeOmeChannels(pixels, description);
  return description;
}

}  // namespace blockwalk
