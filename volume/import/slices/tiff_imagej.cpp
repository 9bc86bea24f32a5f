// SPDX-License-Identifier: Apache-2.0
// What ImageJ writes into ImageDescription: lines of key=value (ij.io.FileSaver, ij.io.TiffDecoder).
#include <cmath>
#include <map>

#include "volume/error.h"
#include "volume/formats/length_unit.h"
#include "volume/formats/time_step.h"
#include "volume/import/frame.h"
#include "volume/import/header_text.h"
#include "volume/import/slices/tiff_description.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

class ImageJFields {
 public:
  explicit ImageJFields(std::string_view text) {
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      const std::string_view line = text.substr(begin, end - begin);
      const std::size_t equals = line.find('=');
      if (equals != std::string_view::npos) {
        fields_.emplace(std::string(line.substr(0, equals)), trimmed(line.substr(equals + 1)));
      }
      begin = end + 1;
    }
  }

  std::string text(const std::string& key) const {
    const auto found = fields_.find(key);
    return found == fields_.end() ? std::string() : found->second;
  }
  std::optional<double> real(const std::string& key) const {
    const auto value = parseReal(text(key));
    return value && std::isfinite(*value) ? value : std::nullopt;
  }
  // At least 1.
  std::int64_t count(const std::string& key, std::int64_t absent) const {
    const auto value = real(key);
    if (!value || *value < 1 || *value > 1e12) return absent;
    return static_cast<std::int64_t>(*value);
  }

 private:
  std::map<std::string, std::string> fields_;
};

// Channels fastest, then slices, then frames.
void orderPages(TiffFile& file, const ImageJFields& fields, const ImportOptions& options, TiffDescription& result) {
  auto pages = static_cast<std::int64_t>(file.pages().size());
  const std::int64_t slices = fields.count("slices", 1);
  const std::int64_t images = fields.count("images", pages);
  if (images > pages) {
    file.takePlanes(images, fmt::format("ImageDescription: images={}", images));
    result.planes = images;
    pages = images;
  }
  const bool is_single = file.pages().front().format.channels == 1;
  std::int64_t channels = is_single ? fields.count("channels", 1) : 1;
  std::int64_t frames = fields.count("frames", 1);
  if (channels > kMaxChannels) {
    failData("{}: ImageDescription: channels={}: at most {} channels can be read; split them into a file each",
             file.name(), channels, kMaxChannels);
  }
  if (pages % channels != 0) {
    failData("{}: ImageDescription: channels={}: the file has {} pages, which are no whole slices of {} channels",
             file.name(), channels, pages, channels);
  }
  // A film of single pictures is read as a stack, with time from front to back, unless one of them is chosen.
  if (frames > 1 && slices == 1 && channels == 1 && !options.choosesStep()) {
    result.notes.push_back(
        fmt::format("the {} slices are frames in time; --time chooses one, --time all imports them as steps", frames));
    frames = 1;
  }
  if (pages % (channels * frames) != 0) {
    failData("{}: ImageDescription: frames={}: the file has {} pages, which are no whole frames of {} channels",
             file.name(), frames, pages, channels);
  }
  const std::string field = fmt::format("ImageDescription: frames={}", frames);
  const auto frame = static_cast<std::int64_t>(chosenFrame(options, frames, file.name(), field, result.notes));
  result.channels = static_cast<std::size_t>(channels);
  const std::int64_t of_frame = pages / frames;
  const std::string time_unit = fields.text("tunit");
  if (frames > 1) {
    result.time_step = timeStepText(fields.real("finterval").value_or(0), time_unit.empty() ? "s" : time_unit);
  }
  for (std::int64_t i = 0; i < of_frame; ++i) {
    result.pages.push_back({.file = 0, .page = static_cast<std::uint32_t>(frame * of_frame + i)});
  }
}

// The tags count pixels a unit; `spacing` is the distance of slices, 1 where it is not said.
void describeSize(const TiffFile& file, const ImageJFields& fields, TiffDescription& result) {
  const TiffResolution& tags = file.pages().front().resolution;
  const bool has_size = tags.x > 0 && tags.y > 0;
  std::string said = fields.text("unit");
  // By TIFF's default tags are inches; without a resolution they are of nothing.
  if (said.empty() && has_size && tags.unit == 2) said = "inch";
  if (said.empty() && has_size && tags.unit == 3) said = "cm";
  // Without a unit of its own, a resolution of 72 or 96 an inch is that of a screen.
  const bool is_screen = fields.text("unit").empty() && tags.x == tags.y && (tags.x == 72 || tags.x == 96);
  glm::dvec3 spacing(1);
  if (has_size && !is_screen) {
    spacing = glm::dvec3(1 / tags.x, 1 / tags.y, 1);
    result.spacing_from = "XResolution, YResolution";
  }
  const auto depth = fields.real("spacing");
  if (depth && *depth != 0) {
    spacing.z = std::fabs(*depth);
    result.spacing_from += result.spacing_from.empty() ? "spacing=, of pixels guessed: 1" : ", spacing=";
  } else if (!result.spacing_from.empty() && result.slices() > 1) {
    result.spacing_from += ", between slices guessed: 1";
  }
  const LengthUnit unit = is_screen ? LengthUnit{} : lengthUnit(said);
  // Newer versions have units for the other axes.
  const std::array<std::string, 3> keys{"", "yunit", "zunit"};
  for (int axis = 1; axis < 3; ++axis) {
    const std::string own = fields.text(keys[static_cast<std::size_t>(axis)]);
    const double factor = own.empty() ? 1 : factorBetween(lengthUnit(own), unit);
    if (factor > 0) spacing[axis] *= factor;
  }
  result.spacing = spacing;
  result.spacing_field = "XResolution, YResolution, spacing=";
  result.length_unit = unit.name;
  // Pixels from the corner of the first to the world's origin.
  const glm::dvec3 origin(fields.real("xorigin").value_or(0), fields.real("yorigin").value_or(0),
                          fields.real("zorigin").value_or(0));
  if (origin != glm::dvec3(0)) result.corner = -origin * spacing;
}

// A straight line from samples to values; other functions are told.
void describeValues(const ImageJFields& fields, TiffDescription& result) {
  const auto offset = fields.real("c0");
  const auto slope = fields.real("c1");
  if (!offset || !slope) return;
  const double kind = fields.real("cf").value_or(0);
  if (kind != 0 || *slope == 0) {
    result.notes.push_back(
        fmt::format("ImageJ's calibration function {} of values is not kept: they are as stored", kind));
    return;
  }
  result.value_scale = *slope;
  result.value_offset = *offset;
  const std::string unit = fields.text("vunit");
  if (lowerCase(unit) != "gray value" && unit.size() <= kMaxUnitBytes) result.value_unit = unit;
}

}  // namespace

std::optional<TiffDescription> describeImageJ(TiffFile& file, std::string_view text, const ImportOptions& options) {
  if (!text.starts_with("ImageJ=")) return std::nullopt;
  const ImageJFields fields(text);
  TiffDescription result;
  orderPages(file, fields, options, result);
  describeSize(file, fields, result);
  describeValues(fields, result);
  return result;
}

}  // namespace blockwalk
