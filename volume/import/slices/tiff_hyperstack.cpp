// SPDX-License-Identifier: Apache-2.0
#include "volume/import/slices/tiff_hyperstack.h"

#include <algorithm>
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

  // Name of the first `count` Channel elements; none when one has no name.
  std::vector<std::string> channelNames(std::size_t count) const {
    std::vector<std::string> names;
    for (const pugi::xml_node& child : pixels_.children()) {
      if (localName(child) != "Channel" || names.size() == count) continue;
      names.emplace_back(child.attribute("Name").value());
      if (names.back().empty()) return {};
    }
    return names.size() == count ? names : std::vector<std::string>();
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
  order.names = pixels.channelNames(order.channels);
  return order;
}

// The order that OME-XML says; nothing where the text is none.
std::optional<PageOrder> omeOrder(const TiffFile& file, std::string_view text) {
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
  return omeOrder(file, OmePixels(file, pixels));
}

}  // namespace

PageOrder pageOrder(const TiffFile& file) {
  const std::string_view text = file.description();
  if (text.starts_with("ImageJ=")) return imageJOrder(file, text);
  return omeOrder(file, text).value_or(PageOrder{});
}

}  // namespace blockwalk
