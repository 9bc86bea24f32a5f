// SPDX-License-Identifier: Apache-2.0
#include "volume/file/metadata.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "volume/error.h"
#include "volume/plain_text.h"

namespace blockwalk {
namespace {

constexpr std::size_t kMaxKeyBytes = 64;

std::string colorText(const Color& color) { return fmt::format("{:02x}{:02x}{:02x}", color[0], color[1], color[2]); }

bool parseColor(std::string_view text, Color& color) {
  if (text.size() != 6) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    const char* begin = text.data() + 2 * i;
    const auto result = std::from_chars(begin, begin + 2, color[i], 16);
    if (result.ec != std::errc() || result.ptr != begin + 2) return false;
  }
  return true;
}

bool parseNumber(std::string_view text, double& number) {
  const auto result = std::from_chars(text.data(), text.data() + text.size(), number);
  return result.ec == std::errc() && result.ptr == text.data() + text.size() && std::isfinite(number);
}

// The text before the first `end`, taken away with it; all of it where there is none.
std::string_view takeUntil(std::string_view& text, char end) {
  const std::size_t at = text.find(end);
  const std::string_view part = text.substr(0, at);
  text.remove_prefix(at == std::string_view::npos ? text.size() : at + 1);
  return part;
}

bool isKey(std::string_view key) {
  return !key.empty() && key.size() <= kMaxKeyBytes && std::ranges::all_of(key, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '.' || c == '-' || c == '+';
  });
}

class Writer {
 public:
  explicit Writer(const std::string& file) : file_(file) {}

  void line(const std::string& key, const std::string& value, std::size_t most = kMaxNameBytes) {
    if (value.empty()) return;
    if (value.size() > most || !isPlainText(value)) {
      failData("{}: metadata {} has {} bytes, must be at most {} of UTF-8 without control characters", file_, key,
               value.size(), most);
    }
    text_ += fmt::format("{}\t{}\n", key, value);
  }

  void channel(std::size_t number, const ChannelInfo& channel) {
    const std::string prefix = fmt::format("channel.{}.", number);
    line(prefix + "name", channel.name, kMaxChannelNameBytes);
    line(prefix + "unit", channel.unit);
    if (channel.color) line(prefix + "color", colorText(*channel.color));
    if (channel.window) line(prefix + "window", fmt::format("{} {}", (*channel.window)[0], (*channel.window)[1]));
    for (const LabelInfo& label : channel.labels) {
      const std::string color = label.color ? colorText(*label.color) : "-";
      line(fmt::format("{}label.{}", prefix, label.value), label.name.empty() ? color : color + " " + label.name,
           kMaxNameBytes + 7);
    }
  }

  std::string finish() {
    if (text_.size() > kMaxMetadataBytes) {
      failData("{}: the metadata have {} bytes, must be at most {}", file_, text_.size(), kMaxMetadataBytes);
    }
    return std::move(text_);
  }

 private:
  const std::string& file_;
  std::string text_;
};

class Reader {
 public:
  Reader(std::size_t offset, const std::string& file, VolumeInfo& info) : offset_(offset), file_(file), info_(info) {}

  void read(std::string_view text) {
    require(text.empty() || text.back() == '\n', "", "lines that end with a line feed");
    while (!text.empty()) {
      const std::size_t before = text.size();
      std::string_view value = takeUntil(text, '\n');
      const std::string_view key = takeUntil(value, '\t');
      require(isKey(key), "", "a key of 1..64 lower-case letters, digits and _.-+, a tab, a value");
      require(keys_.insert(std::string(key)).second, key, "there once");
      require(!value.empty() && isPlainText(value), key, "UTF-8 without control characters, not empty");
      take(key, value);
      offset_ += before - text.size();
    }
  }

 private:
  void require(bool holds, std::string_view key, std::string_view bound) const {
    if (!holds) failData("{}: metadata {} at offset {} must be {}", file_, key, offset_, bound);
  }

  void take(std::string_view key, std::string_view value) {
    Metadata& metadata = info_.metadata;
    if (key == "source") return name(metadata.source_name, key, value);
    if (key == "source_kind") return name(metadata.source_kind, key, value);
    if (key == "length_unit") return name(metadata.length_unit, key, value);
    if (key == "space") return name(metadata.space, key, value);
    if (key.starts_with("channel.")) {
      std::string_view rest = key.substr(8);
      const std::string_view number = takeUntil(rest, '.');
      const bool known = number.size() == 1 && number[0] >= '0' && number[0] - '0' < static_cast<int>(channels());
      require(known, key, fmt::format("of a channel below {}", channels()));
      if (takeOfChannel(info_.channels[static_cast<std::size_t>(number[0] - '0')], key, rest, value)) return;
    }
    metadata.others.emplace_back(key, value);
  }

  bool takeOfChannel(ChannelInfo& channel, std::string_view key, std::string_view field, std::string_view value) {
    if (field == "name") {
      name(channel.name, key, value, kMaxChannelNameBytes);
    } else if (field == "unit") {
      name(channel.unit, key, value);
    } else if (field == "color") {
      require(parseColor(value, channel.color.emplace()), key, "rrggbb");
    } else if (field == "window") {
      std::array<double, 2>& window = channel.window.emplace();
      const std::string_view lo = takeUntil(value, ' ');
      const bool right = parseNumber(lo, window[0]) && parseNumber(value, window[1]) && window[0] <= window[1];
      require(right, key, "two finite numbers, ascending");
    } else if (field.starts_with("label.")) {
      LabelInfo label;
      const bool ascends = parseNumber(field.substr(6), label.value) &&
                           (channel.labels.empty() || channel.labels.back().value < label.value);
      require(ascends, key, "of a finite number above the label's before");
      const std::string_view color = takeUntil(value, ' ');
      require(color == "-" || parseColor(color, label.color.emplace()), key, "rrggbb or -, and a name");
      name(label.name, key, value);
      channel.labels.push_back(std::move(label));
    } else {
      return false;
    }
    return true;
  }

  void name(std::string& out, std::string_view key, std::string_view value, std::size_t most = kMaxNameBytes) {
    require(value.size() <= most, key, fmt::format("at most {} bytes", most));
    out = value;
  }

  std::size_t channels() const { return info_.channels.size(); }

  std::size_t offset_;  // of the line
  const std::string& file_;
  VolumeInfo& info_;
  std::set<std::string, std::less<>> keys_;
};

}  // namespace

std::string encodeMetadata(const VolumeInfo& info, const std::string& file) {
  Writer writer(file);
  writer.line("source", info.metadata.source_name);
  writer.line("source_kind", info.metadata.source_kind);
  writer.line("length_unit", info.metadata.length_unit);
  writer.line("space", info.metadata.space);
  for (std::size_t i = 0; i < info.channels.size(); ++i) writer.channel(i, info.channels[i]);
  for (const auto& [key, value] : info.metadata.others) writer.line(key, value);
  return writer.finish();
}

void decodeMetadata(std::string_view text, std::size_t offset, const std::string& file, VolumeInfo& info) {
  Reader(offset, file, info).read(text);
}

}  // namespace blockwalk
