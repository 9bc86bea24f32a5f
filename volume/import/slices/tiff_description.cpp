// SPDX-License-Identifier: Apache-2.0
#include "volume/import/slices/tiff_description.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <pugixml.hpp>
#include <string_view>

#include "volume/error.h"
#include "volume/import/header_text.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

// The number behind `key`, as in ImageJ's "channels=2".
std::optional<std::int64_t> numberAfter(std::string_view text, std::string_view key) {
  const std::size_t found = text.find(key);
  if (found == std::string_view::npos) return std::nullopt;
  const std::string_view rest = text.substr(found + key.size());
  return parseInteger(rest.substr(0, std::min(rest.find_first_not_of("0123456789"), rest.size())));
}

std::size_t checkedChannels(const TiffFile& file, std::string_view field, std::int64_t channels) {
  const auto pages = static_cast<std::int64_t>(file.pages().size());
  if (channels > kMaxChannels) {
    failData("{}: ImageDescription: {}: at most {} channels can be read; split them into a file each", file.name(),
             field, kMaxChannels);
  }
  if (pages % channels != 0) {
    failData("{}: ImageDescription: {}: the file has {} pages, which are no whole slices of {} channels", file.name(),
             field, pages, channels);
  }
  return static_cast<std::size_t>(channels);
}

// ImageJ writes channels fastest, then slices, then frames (ij.io.TiffDecoder, order "xyczt").
PageOrder imageJOrder(const TiffFile& file, std::string_view text) {
  const TiffPage& page = file.pages().front();
  const auto pages = static_cast<std::int64_t>(file.pages().size());
  const std::int64_t channels = numberAfter(text, "\nchannels=").value_or(1);
  const std::int64_t frames = numberAfter(text, "\nframes=").value_or(1);
  const std::int64_t slices = numberAfter(text, "\nslices=").value_or(1);
  const std::int64_t images = numberAfter(text, "\nimages=").value_or(pages);
  if (frames > 1 && (slices > 1 || channels > 1)) {
    failData("{}: ImageDescription: frames={}: the pages are a series in time; split it into a file a time",
             file.name(), frames);
  }
  if (images > pages) {
    failData("{}: ImageDescription: images={}, but the file has {} pages; the data behind them cannot be read",
             file.name(), images, pages);
  }
  PageOrder order;
  if (channels > 1 && page.format.channels == 1) {
    order.channels = checkedChannels(file, fmt::format("channels={}", channels), channels);
  }
  return order;
}

// The name of an element without the prefix of its namespace.
std::string_view localName(const pugi::xml_node& node) {
  const std::string_view name = node.name();
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

// One OME-XML Pixels element: what it says of the order of pages.
class OmePixels {
 public:
  OmePixels(const TiffFile& file, const pugi::xml_node& pixels) : file_(file), pixels_(pixels) {}

  // 1 where the attribute is missing.
  std::int64_t size(const char* attribute) const {
    const pugi::xml_attribute found = pixels_.attribute(attribute);
    if (!found) return 1;
    const auto value = parseInteger(found.value());
    if (!value || *value < 1) {
      failData("{}: ImageDescription: {}=\"{}\" is no whole number of at least 1", file_.name(), attribute,
               found.value());
    }
    return *value;
  }

  std::string_view dimensionOrder() const { return pixels_.attribute("DimensionOrder").as_string("XYCZT"); }

  std::vector<pugi::xml_node> channels() const {
    std::vector<pugi::xml_node> found;
    for (const pugi::xml_node& child : pixels_.children()) {
      if (localName(child) == "Channel") found.push_back(child);
    }
    return found;
  }

  // PhysicalSizeX and so on; nothing where the attribute is missing.
  std::optional<double> physicalSize(const std::string& attribute) const {
    const pugi::xml_attribute found = pixels_.attribute(attribute.c_str());
    if (!found) return std::nullopt;
    const auto value = parseReal(found.value());
    if (!value || !std::isfinite(*value) || *value <= 0) {
      failData("{}: ImageDescription: {}=\"{}\" is no finite number above 0", file_.name(), attribute, found.value());
    }
    return value;
  }
  // As OME has it, micrometres where nothing is said.
  std::string unit(const std::string& attribute) const {
    return pixels_.attribute(attribute.c_str()).as_string("\xc2\xb5m");
  }

 private:
  const TiffFile& file_;
  pugi::xml_node pixels_;
};

// The OME data model, Pixels: SizeC, SizeZ, SizeT and DimensionOrder, fastest axis first.
PageOrder omeOrder(const TiffFile& file, const OmePixels& pixels) {
  const int samples = file.pages().front().format.channels;
  if (const std::int64_t times = pixels.size("SizeT"); times > 1) {
    failData("{}: ImageDescription: SizeT=\"{}\": the pages are a series in time; split it into a file a time",
             file.name(), times);
  }
  const std::int64_t channels = pixels.size("SizeC");
  PageOrder order;
  if (channels <= 1 || channels == samples) return order;
  if (samples > 1) {
    failData("{}: ImageDescription: SizeC=\"{}\": the pages have {} samples each; split the channels into a file each",
             file.name(), channels, samples);
  }
  order.channels = checkedChannels(file, fmt::format("SizeC=\"{}\"", channels), channels);
  const auto pages = static_cast<std::int64_t>(file.pages().size());
  const std::int64_t slices = pixels.size("SizeZ");
  if (pages % channels != 0 || slices != pages / channels) {
    failData("{}: ImageDescription: SizeZ=\"{}\": {} slices of {} channels are not the file's {} pages", file.name(),
             slices, slices, channels, pages);
  }
  const std::string_view axes = pixels.dimensionOrder();
  const std::size_t c = axes.find('C');
  const std::size_t z = axes.find('Z');
  if (!axes.starts_with("XY") || c == std::string_view::npos || z == std::string_view::npos) {
    failData("{}: ImageDescription: DimensionOrder=\"{}\" cannot be read", file.name(), axes);
  }
  order.channels_fastest = c < z;
  return order;
}

// A unit of length of OME-XML as volumes say it, and its metres; 0 where that is not known.
struct LengthUnit {
  std::string name;
  double metres = 0;
};
LengthUnit lengthUnit(const std::string& name) {
  // Both signs that look like the Greek letter.
  static const std::array<std::pair<std::string_view, LengthUnit>, 8> kUnits = {{{"\xc2\xb5m", {"um", 1e-6}},
                                                                                 {"\xce\xbcm", {"um", 1e-6}},
                                                                                 {"pm", {"pm", 1e-12}},
                                                                                 {"\xc3\x85", {"angstrom", 1e-10}},
                                                                                 {"nm", {"nm", 1e-9}},
                                                                                 {"mm", {"mm", 1e-3}},
                                                                                 {"cm", {"cm", 1e-2}},
                                                                                 {"m", {"m", 1}}}};
  for (const auto& [ome, unit] : kUnits) {
    if (name == ome) return unit;
  }
  return {.name = name, .metres = 0};
}

// The size of a voxel in the unit of its x side. Left out where a side is not said, or has a unit that cannot be
// expressed in that one. A single slice is as thick as it is wide where its thickness is not said.
void describeSize(const OmePixels& pixels, TiffDescription& description) {
  std::array<std::optional<double>, 3> sizes;
  std::array<LengthUnit, 3> units;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string attribute = std::string("PhysicalSize") + "XYZ"[axis];
    sizes[axis] = pixels.physicalSize(attribute);
    units[axis] = lengthUnit(pixels.unit(attribute + "Unit"));
  }
  if (!sizes[2] && pixels.size("SizeZ") == 1) {
    sizes[2] = sizes[0];
    units[2] = units[0];
  }
  glm::dvec3 spacing(0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool same = units[axis].name == units[0].name;
    const double factor = same ? 1 : units[axis].metres / units[0].metres;
    if (!sizes[axis] || !std::isfinite(factor) || factor <= 0) return;
    spacing[static_cast<int>(axis)] = *sizes[axis] * factor;
  }
  description.spacing = spacing;
  // Not a length: voxels are this long beside each other, and no more is known.
  const std::string& unit = units[0].name;
  if (unit != "pixel" && unit != "reference frame" && unit.size() <= kMaxUnitBytes) description.length_unit = unit;
}

// Names and colours of the Channel elements. A name is taken where every channel has one.
void describeChannels(const OmePixels& pixels, TiffDescription& description) {
  for (const pugi::xml_node& channel : pixels.channels()) {
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

// What OME-XML says; nothing where the text is none.
std::optional<TiffDescription> omeDescription(const TiffFile& file, std::string_view text) {
  const std::string_view content = trimmed(text.starts_with("\xef\xbb\xbf") ? text.substr(3) : text);
  if (!content.starts_with('<') || content.find("OME") == std::string_view::npos) return std::nullopt;
  pugi::xml_document document;
  const pugi::xml_parse_result parsed =
      document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
  const bool is_ome = localName(document.document_element()) == "OME";
  if (!parsed) {
    failData("{}: ImageDescription: its XML is broken at byte {}: {}", file.name(), parsed.offset,
             parsed.description());
  }
  if (!is_ome) return std::nullopt;
  const pugi::xml_node pixels =
      document.find_node([](const pugi::xml_node& node) { return localName(node) == "Pixels"; });
  if (!pixels) failData("{}: ImageDescription: its OME-XML has no Pixels", file.name());
  const OmePixels ome(file, pixels);
  TiffDescription description{.order = omeOrder(file, ome)};
  describeSize(ome, description);
  describeChannels(ome, description);
  return description;
}

}  // namespace

TiffDescription describePages(const TiffFile& file) {
  const std::string_view text = file.description();
  if (text.starts_with("ImageJ=")) return {.order = imageJOrder(file, text)};
  return omeDescription(file, text).value_or(TiffDescription{});
}

}  // namespace blockwalk
