// SPDX-License-Identifier: Apache-2.0
#include "volume/import/slices/tiff_description.h"

#include "volume/formats/length_unit.h"

namespace blockwalk {
namespace {

// Pixels of a screen or of paper: what programs write that know no size.
bool isOfAScreen(const TiffResolution& resolution) {
  return resolution.unit == 2 && resolution.x == resolution.y && (resolution.x == 72 || resolution.x == 96);
}

// The size of a pixel, by the tags. They say nothing of the distance of slices, which is taken to be the same.
void describeByTags(const TiffFile& file, TiffDescription& description) {
  const TiffPage& page = file.pages().front();
  const TiffResolution& said = page.resolution;
  if (said.x <= 0 || said.y <= 0 || isOfAScreen(said)) return;
  const double millimetres = said.unit == 2 ? 25.4 : said.unit == 3 ? 10 : 0;
  const bool is_one = millimetres == 0;
  if (is_one && said.x == said.y) return;
  glm::dvec2 size = is_one ? glm::dvec2(1, said.x / said.y) : millimetres / glm::dvec2(said.x, said.y);
  if (page.orientation > 4) size = glm::dvec2(size.y, size.x);
  description.spacing = glm::dvec3(size, size.x);
  description.spacing_field = "XResolution, YResolution";
  description.spacing_from = description.spacing_field;
  description.is_depth_guessed = true;
  if (!is_one) description.length_unit = "mm";
}

// But for how much coarser than its finest level the file's level is.
TiffDescription describeFinest(TiffFile& file, const std::filesystem::path& path, const ImportOptions& options) {
  const std::string_view text = file.description();
  if (auto said = describeImageJ(file, text, options)) return std::move(*said);
  if (auto said = describeOme(file, path, text, options)) return std::move(*said);
  TiffDescription description;
  for (std::size_t i = 0; i < file.pages().size(); ++i) {
    description.pages.push_back({.file = 0, .page = static_cast<std::uint32_t>(i)});
  }
  describeByTags(file, description);
  return description;
}

}  // namespace

TiffDescription describePages(TiffFile& file, const std::filesystem::path& path, const ImportOptions& options) {
  TiffDescription description = describeFinest(file, path, options);
  const glm::dvec2 shrunk = file.pages().front().shrunk;
  if (shrunk != glm::dvec2(1)) {
    if (!description.spacing) description.spacing_from = "guessed: 1 at level 0, the file says none";
    description.spacing = description.spacing.value_or(glm::dvec3(1)) * glm::dvec3(shrunk, 1);
  }
  if (!options.level && file.levels() > 1) {
    description.notes.push_back(fmt::format("of {} levels it is the finest; --level chooses another", file.levels()));
  }
  return description;
}

}  // namespace blockwalk
