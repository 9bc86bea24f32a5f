// SPDX-License-Identifier: Apache-2.0
// Coarser levels of TIFF pages: reduced copies in the SubIFDs of each page, as Bio-Formats writes them, or as pages of
// their own behind it or behind all.
#include <algorithm>

#include "volume/import/slices/tiff_decoder.h"
#include "volume/import/slices/tiff_page.h"

namespace blockwalk {

// What the directory that libtiff has at hand says of coarser levels.
void TiffFile::Decoder::noteCoarser() {
  if (isReducedPage(tiff)) reduced.emplace_back(TIFFCurrentDirOffset(tiff), pages.size());
  if (isSecondaryPage(tiff)) return;
  std::uint16_t count = 0;
  const std::uint64_t* offsets = nullptr;
  if (TIFFGetField(tiff, TIFFTAG_SUBIFD, &count, &offsets) != 1 || offsets == nullptr) count = 0;
  if (pages.back().depth > 1) count = 0;
  sub_levels = std::min<int>(sub_levels, count);
  if (level > 0 && level <= sub_levels) sub_directories.push_back(offsets[level - 1]);
}

// Where the directory of the level of a page is.
std::uint64_t TiffFile::Decoder::coarserOf(std::size_t wanted) const {
  if (sub_levels > 0) return sub_directories[wanted];
  const std::size_t own = static_cast<std::size_t>(level - 1);
  const bool follows_each = reduced.front().second < pages.size();
  return reduced[follows_each ? wanted * (reduced.size() / pages.size()) + own : own * pages.size() + wanted].first;
}

void TiffFile::Decoder::chooseLevel() {
  const std::size_t count = pages.size();
  const std::size_t each = reduced.size() / count;
  bool is_pyramid = each > 0 && reduced.size() % count == 0 && pages.front().depth == 1;
  const bool follows_each = is_pyramid && reduced.front().second < count;
  for (std::size_t i = 0; i < reduced.size() && is_pyramid; ++i) {
    is_pyramid = reduced[i].second == (follows_each ? i / each + 1 : count);
  }
  levels = 1 + (sub_levels > 0 ? sub_levels : is_pyramid ? static_cast<int>(each) : 0);
  if (level < 0 || level >= levels) {
    failData("{}: level {} is asked for, must be 0..{}{}", file.name(), level, levels - 1,
             levels == 1 && !reduced.empty()
                 ? fmt::format("; the reduced copies of {} pages are {}, no level has all", count, reduced.size())
                 : "");
  }
  for (std::size_t i = 0; i < count && level > 0; ++i) {
    const TiffPage finest = pages[i];
    message[0] = '\0';
    if (TIFFSetSubDirectory(tiff, coarserOf(i)) == 0) fail(finest);
    TiffPage coarse = readTiffPage(tiff, file.name(), finest.number);
    if (coarse.orientation == 0) coarse.orientation = finest.orientation;
    const bool is_smaller = coarse.width <= finest.width && coarse.height <= finest.height &&
                            (coarse.width < finest.width || coarse.height < finest.height);
    if (!is_smaller || coarse.depth > 1 || finest.depth > 1 || coarse.format != finest.format) {
      failData("{}: page {}: level {} has {} x {} pixels of {} x {}, which is no coarser copy of {} x {} of {} x {}",
               file.name(), finest.number, level, coarse.width, coarse.height, coarse.format.channels,
               sampleTypeName(coarse.format.type), finest.width, finest.height, finest.format.channels,
               sampleTypeName(finest.format.type));
    }
    coarse.resolution = finest.resolution;
    coarse.shrunk = {static_cast<double>(finest.seenWidth()) / coarse.seenWidth(),
                     static_cast<double>(finest.seenHeight()) / coarse.seenHeight()};
    pages[i] = coarse;
  }
}

}  // namespace blockwalk
