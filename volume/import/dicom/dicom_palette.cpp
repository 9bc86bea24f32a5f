// SPDX-License-Identifier: Apache-2.0
#include "volume/import/dicom/dicom_palette.h"

#include <algorithm>
#include <cmath>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::array<const char*, 3> kColors = {"Red", "Green", "Blue"};

std::uint32_t descriptorTag(std::size_t color) { return dicomTag(0x0028, 0x1101 + static_cast<std::uint32_t>(color)); }
std::uint32_t dataTag(std::size_t color, bool is_segmented) {
  return dicomTag(0x0028, (is_segmented ? 0x1221 : 0x1201) + static_cast<std::uint32_t>(color));
}

// One table, of entries or of segments.
class PaletteTable {
 public:
  PaletteTable(const DicomPalette& palette, std::size_t color, const std::string& name)
      : palette_(palette), data_(palette.tables[color]), color_(color), name_(name) {}

  std::vector<std::uint16_t> expand() {
    if (palette_.is_segmented) {
      expandSegments(0, SIZE_MAX, false);
    } else {
      takeEntries();
    }
    if (entries_.size() != wanted()) fail("has {} entries, its descriptor says {}", entries_.size(), wanted());
    return std::move(entries_);
  }

 private:
  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    failData("{}: {}{}PaletteColorLookupTableData: {}", name_, palette_.is_segmented ? "Segmented" : "",
             kColors[color_], fmt::format(format, std::forward<Args>(args)...));
  }

  std::size_t wanted() const { return static_cast<std::size_t>(palette_.entries); }

  std::uint16_t byteAt(std::size_t at) const {
    // Two of them are a word in the file.
    const std::size_t there = palette_.is_big_endian && (at ^ 1) < data_.size() ? at ^ 1 : at;
    return static_cast<unsigned char>(data_[there]);
  }
  std::uint16_t wordAt(std::size_t index) const {
    const auto low = static_cast<unsigned char>(data_[2 * index + (palette_.is_big_endian ? 1 : 0)]);
    const auto high = static_cast<unsigned char>(data_[2 * index + (palette_.is_big_endian ? 0 : 1)]);
    return static_cast<std::uint16_t>(low | high << 8);
  }

  void takeEntries() {
    const bool are_words = palette_.bits == 16 || data_.size() >= 2 * wanted();  // of 8 bits they may be in words too
    if (data_.size() < wanted() * (are_words ? 2 : 1)) {
      fail("has {} bytes, {} entries of {} bits need {}", data_.size(), wanted(), palette_.bits,
           wanted() * (are_words ? 2 : 1));
    }
    for (std::size_t i = 0; i < wanted(); ++i) {
      const std::uint16_t value = are_words ? wordAt(i) : byteAt(i);
      entries_.push_back(palette_.bits == 8 ? static_cast<std::uint16_t>(value & 0xff) : value);
    }
  }

  std::size_t parts() const { return palette_.bits == 16 ? data_.size() / 2 : data_.size(); }
  std::uint16_t next(std::size_t& at) const {
    if (at >= parts()) fail("ends in a segment, at byte {}", data_.size());
    const std::size_t index = at++;
    return palette_.bits == 16 ? wordAt(index) : byteAt(index);
  }

  // `count` segments from part `at` on, or all.
  void expandSegments(std::size_t at, std::size_t count, bool is_repeated) {
    const std::size_t padding = palette_.bits == 8 ? 1 : 0;  // texts and bytes have even lengths
    for (std::size_t i = 0; i < count && (count != SIZE_MAX || at + padding < parts()); ++i) {
      constexpr std::size_t kMostSegments = std::size_t{1} << 18;
      if (++segments_ > kMostSegments) fail("has more than {} segments", kMostSegments);
      const std::size_t begin = at;
      const std::uint16_t kind = next(at);
      const std::size_t length = next(at);
      if (kind > 2 || (kind == 2 && is_repeated)) fail("segment of kind {} at its part {} cannot be", kind, begin);
      if (kind == 2) {
        std::size_t from = 0;
        for (int part = 0, shift = 0; part < (palette_.bits == 16 ? 2 : 4); ++part, shift += palette_.bits) {
          from |= static_cast<std::size_t>(next(at)) << shift;
        }
        expandSegments(palette_.bits == 16 ? from / 2 : from, length, true);
        continue;
      }
      if (entries_.size() + length > wanted()) fail("has more than the {} entries of its descriptor", wanted());
      if (kind == 0) {
        for (std::size_t k = 0; k < length; ++k) entries_.push_back(next(at));
      } else {
        addRamp(length, next(at));
      }
    }
  }

  // From the last entry, which is not one of them, to `end`, which is.
  void addRamp(std::size_t length, std::uint16_t end) {
    if (entries_.empty()) fail("begins with a segment that goes on from the entry before");
    const double begin = entries_.back();
    for (std::size_t k = 1; k <= length; ++k) {
      const double value = begin + (end - begin) * static_cast<double>(k) / static_cast<double>(length);
      entries_.push_back(static_cast<std::uint16_t>(std::lround(value)));
    }
  }

  const DicomPalette& palette_;
  const std::string& data_;
  std::size_t color_;
  const std::string& name_;
  std::vector<std::uint16_t> entries_;
  std::size_t segments_ = 0;
};

}  // namespace

std::shared_ptr<const DicomPalette> readDicomPalette(const DicomFile& file, bool is_signed) {
  auto palette = std::make_shared<DicomPalette>();
  palette->is_big_endian = file.is_big_endian;
  palette->is_segmented = !file.set.values.contains(dataTag(0, false));
  for (std::size_t color = 0; color < 3; ++color) {
    const auto said = file.wholes(file.set, descriptorTag(color));
    if (said.size() < 3)
      failData("{}: {}PaletteColorLookupTableDescriptor: {} numbers, not 3", file.name, kColors[color], said.size());
    const int entries = said[0] == 0 ? 65536 : said[0];
    const int first = is_signed && said[1] > 32767 ? said[1] - 65536 : said[1];
    if (said[2] != 8 && said[2] != 16) {
      failData("{}: {}PaletteColorLookupTableDescriptor: {} bits an entry cannot be read; 8 and 16 can", file.name,
               kColors[color], said[2]);
    }
    if (color > 0 && (entries != palette->entries || first != palette->first || said[2] != palette->bits)) {
      failData("{}: {}PaletteColorLookupTableDescriptor: differs from the red one", file.name, kColors[color]);
    }
    palette->entries = entries;
    palette->first = first;
    palette->bits = said[2];
    const auto data = file.set.values.find(dataTag(color, palette->is_segmented));
    if (data == file.set.values.end())
      failData("{}: {}PaletteColorLookupTableData: the element is missing", file.name, kColors[color]);
    palette->tables[color] = data->second;
  }
  expandPalette(*palette, file.name);
  return palette;
}

std::vector<std::uint16_t> expandPalette(const DicomPalette& palette, const std::string& name) {
  std::vector<std::uint16_t> colors(static_cast<std::size_t>(palette.entries) * 3);
  for (std::size_t color = 0; color < 3; ++color) {
    const std::vector<std::uint16_t> entries = PaletteTable(palette, color, name).expand();
    for (std::size_t i = 0; i < entries.size(); ++i) colors[i * 3 + color] = entries[i];
  }
  return colors;
}

}  // namespace blockwalk
