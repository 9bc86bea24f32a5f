// SPDX-License-Identifier: Apache-2.0
#include "volume/import/slices/tiff_hyperstack.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "volume/error.h"
#include "volume/import/header_text.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

// The number behind `key`, as in ImageJ's "channels=2" and OME-XML's SizeC="2".
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

// The text of an XML attribute; the five entities that every writer must use are read.
std::string unescaped(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, char>, 5> kEntities{
      {{"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}, {"&amp;", '&'}}};
  std::string result;
  while (!text.empty()) {
    const auto entity = std::ranges::find_if(kEntities, [&](const auto& one) { return text.starts_with(one.first); });
    result += entity == kEntities.end() ? text.front() : entity->second;
    text.remove_prefix(entity == kEntities.end() ? 1 : entity->first.size());
  }
  return result;
}

// Name="..." of the first `count` Channel elements; none when one has no name.
std::vector<std::string> omeChannelNames(std::string_view text, std::size_t count) {
  std::vector<std::string> names;
  while (names.size() < count) {
    const std::size_t begin = text.find("<Channel ");
    if (begin == std::string_view::npos) return {};
    text.remove_prefix(begin);
    const std::string_view element = text.substr(0, text.find('>'));
    const std::size_t name = element.find(" Name=\"");
    if (name == std::string_view::npos) return {};
    const std::string_view value = element.substr(name + 7);
    names.push_back(unescaped(value.substr(0, value.find('"'))));
    text.remove_prefix(element.size());
  }
  return names;
}

// The OME data model, Pixels: SizeC, SizeZ, SizeT and DimensionOrder, fastest axis first.
PageOrder omeOrder(const TiffFile& file, std::string_view text) {
  const int samples = file.pages().front().format.channels;
  const std::int64_t times = numberAfter(text, " SizeT=\"").value_or(1);
  if (times > 1) {
    failData("{}: ImageDescription: SizeT=\"{}\": the pages are a series in time; split it into a file a time",
             file.name(), times);
  }
  const std::int64_t channels = numberAfter(text, " SizeC=\"").value_or(1);
  PageOrder order;
  if (channels <= 1 || channels == samples) return order;
  if (samples > 1) {
    failData("{}: ImageDescription: SizeC=\"{}\": the pages have {} samples each; split the channels into a file each",
             file.name(), channels, samples);
  }
  order.channels = checkedChannels(file, fmt::format("SizeC=\"{}\"", channels), channels);
  const auto pages = static_cast<std::int64_t>(file.pages().size());
  const std::int64_t slices = numberAfter(text, " SizeZ=\"").value_or(1);
  if (slices * channels != pages) {
    failData("{}: ImageDescription: SizeZ=\"{}\": {} slices of {} channels are not the file's {} pages", file.name(),
             slices, slices, channels, pages);
  }
  const std::size_t at = text.find(" DimensionOrder=\"");
  const std::string_view axes = at == std::string_view::npos ? "XYCZT" : text.substr(at + 17, 5);
  const std::size_t c = axes.find('C');
  const std::size_t z = axes.find('Z');
  if (!axes.starts_with("XY") || c == std::string_view::npos || z == std::string_view::npos) {
    failData("{}: ImageDescription: DimensionOrder=\"{}\" cannot be read", file.name(), axes);
  }
  order.channels_fastest = c < z;
  order.names = omeChannelNames(text, order.channels);
  return order;
}

}  // namespace

PageOrder pageOrder(const TiffFile& file) {
  const std::string_view text = file.pages().front().description;
  if (text.starts_with("ImageJ=")) return imageJOrder(file, text);
  if (text.find("<OME") != std::string_view::npos) return omeOrder(file, text);
  return {};
}

}  // namespace blockwalk
