// SPDX-License-Identifier: Apache-2.0
// omero: how channels are shown. image-label: what the values of labels are.
#include <algorithm>
#include <charconv>
#include <map>
#include <string_view>

#include "volume/error.h"
#include "volume/import/zarr/ome_image.h"
#include "volume/plain_text.h"

namespace blockwalk {
namespace {

// As much as the metadata of a volume have room for, beside all else.
constexpr std::size_t kMostLabelBytes = std::size_t{512} << 10;
constexpr std::size_t kLineBytes = 64;  // of a label without its name
constexpr std::size_t kMostLabelNameBytes = 512;

std::string cutText(std::string text, std::size_t most) {
  while (text.size() > most) {
    do {
      text.pop_back();
    } while (!text.empty() && (static_cast<unsigned char>(text.back()) & 0xc0) == 0x80);
  }
  return isPlainText(text) ? text : plainText(text);
}

std::optional<std::array<std::uint8_t, 3>> colorOf(std::string_view text) {
  if (text.starts_with('#')) text.remove_prefix(1);
  if (text.size() != 6) return std::nullopt;
  std::array<std::uint8_t, 3> color{};
  for (std::size_t i = 0; i < 3; ++i) {
    const char* begin = text.data() + 2 * i;
    if (std::from_chars(begin, begin + 2, color[i], 16).ptr != begin + 2) return std::nullopt;
  }
  return color;
}

void describeChannel(const ZarrField& said, bool is_alone, SourceChannel& channel) {
  if (const auto label = said.find("label"); label && !is_alone) {
    channel.name = cutText(label->value().is_string() ? label->text() : label->value().dump(), kMaxChannelNameBytes);
  }
  if (const auto color = said.find("color"); color && color->value().is_string())
    channel.color = colorOf(color->text());
  const auto window = said.find("window");
  const auto start = window ? window->find("start") : std::nullopt;
  const auto end = window ? window->find("end") : std::nullopt;
  if (!start || !end) return;
  if (start->number() < end->number()) channel.window = {start->number(), end->number()};
}

std::array<std::uint8_t, 3> colorOfRgba(const ZarrField& rgba) {
  std::array<std::uint8_t, 3> color{};
  const std::vector<ZarrField> parts = rgba.elements();
  if (parts.size() != 3 && parts.size() != 4) rgba.fail("must have 3 or 4 numbers");
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t part = parts[i].integer();
    if (part < 0 || part > 255) parts[i].fail("must be 0..255");
    color[i] = static_cast<std::uint8_t>(part);
  }
  return color;
}

// Of its properties the one that is a name, or the first text.
std::string nameOf(const ZarrField& property) {
  for (const char* key : {"name", "label", "class"}) {
    const auto name = property.find(key);
    if (name && name->value().is_string()) return cutText(name->text(), kMostLabelNameBytes);
  }
  for (const auto& [key, value] : property.value().items()) {
    if (value.is_string()) return cutText(value.get<std::string>(), kMostLabelNameBytes);
  }
  return {};
}

std::optional<std::string> describeLabels(const ZarrField& said, SourceChannel& channel) {
  std::map<double, LabelInfo> labels;
  const auto labelOf = [&](const ZarrField& entry) -> LabelInfo& {
    const double value = entry.get("label-value").number();
    labels[value].value = value;
    return labels[value];
  };
  if (const auto colors = said.find("colors")) {
    for (const ZarrField& entry : colors->elements()) {
      LabelInfo& label = labelOf(entry);
      if (const auto rgba = entry.find("rgba")) label.color = colorOfRgba(*rgba);
    }
  }
  if (const auto properties = said.find("properties")) {
    for (const ZarrField& entry : properties->elements()) labelOf(entry).name = nameOf(entry);
  }
  std::size_t bytes = 0;
  for (const auto& [value, label] : labels) {
    bytes += kLineBytes + label.name.size();
    if (bytes > kMostLabelBytes) {
      return fmt::format("of {} labels the first {} keep their names and colours", labels.size(),
                         channel.labels.size());
    }
    channel.labels.push_back(label);
  }
  return std::nullopt;
}

}  // namespace

std::vector<std::string> describeOmeChannels(const OmeImage& image, std::vector<SourceChannel>& channels) {
  std::vector<std::string> notes;
  const ZarrField ome(image.attributes, image.file);
  if (const auto labels = ome.find("image-label")) {
    for (SourceChannel& channel : channels) channel.is_labels = true;
    if (auto note = describeLabels(*labels, channels.front())) notes.push_back(std::move(*note));
  }
  const auto omero = ome.find("omero");
  const auto list = omero ? omero->find("channels") : std::nullopt;
  if (!list) return notes;
  const std::vector<ZarrField> said = list->elements();
  for (std::size_t i = 0; i < std::min(said.size(), channels.size()); ++i) {
    describeChannel(said[i], channels.size() == 1, channels[i]);
  }
  return notes;
}

}  // namespace blockwalk
