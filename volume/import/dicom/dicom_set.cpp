// SPDX-License-Identifier: Apache-2.0
#include "volume/import/dicom/dicom_set.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <set>

#include "volume/error.h"
#include "volume/import/header_text.h"

namespace blockwalk {
namespace {

constexpr std::uint32_t kItem = dicomTag(0xfffe, 0xe000);
constexpr std::uint32_t kItemEnd = dicomTag(0xfffe, 0xe00d);
constexpr std::uint32_t kSequenceEnd = dicomTag(0xfffe, 0xe0dd);
constexpr std::uint32_t kUndefined = 0xffffffff;
constexpr std::uint64_t kMostValueBytes = std::uint64_t{1} << 20;
constexpr std::uint64_t kMostKeptBytes = std::uint64_t{64} << 20;
constexpr int kMostDepth = 16;

// All that is kept, by the names of PS3.6.
const std::set<std::uint32_t>& keptTags() {
  static const std::set<std::uint32_t> tags = {
      dicomTag(0x0002, 0x0010),  // TransferSyntaxUID
      dicomTag(0x0008, 0x0005),  // SpecificCharacterSet
      dicomTag(0x0008, 0x0060),  // Modality
      dicomTag(0x0018, 0x0050),  // SliceThickness
      dicomTag(0x0018, 0x0088),  // SpacingBetweenSlices
      dicomTag(0x0018, 0x1164),  // ImagerPixelSpacing
      dicomTag(0x0020, 0x000e),  // SeriesInstanceUID
      dicomTag(0x0020, 0x0013),  // InstanceNumber
      dicomTag(0x0020, 0x0032),  // ImagePositionPatient
      dicomTag(0x0020, 0x0037),  // ImageOrientationPatient
      dicomTag(0x0028, 0x0002),  // SamplesPerPixel
      dicomTag(0x0028, 0x0004),  // PhotometricInterpretation
      dicomTag(0x0028, 0x0006),  // PlanarConfiguration
      dicomTag(0x0028, 0x0008),  // NumberOfFrames
      dicomTag(0x0028, 0x0010),  // Rows
      dicomTag(0x0028, 0x0011),  // Columns
      dicomTag(0x0028, 0x0030),  // PixelSpacing
      dicomTag(0x0028, 0x0100),  // BitsAllocated
      dicomTag(0x0028, 0x0101),  // BitsStored
      dicomTag(0x0028, 0x0102),  // HighBit
      dicomTag(0x0028, 0x0103),  // PixelRepresentation
      dicomTag(0x0028, 0x1052),  // RescaleIntercept
      dicomTag(0x0028, 0x1053),  // RescaleSlope
      dicomTag(0x0028, 0x1054),  // RescaleType
      dicomTag(0x0028, 0x1101),  // RedPaletteColorLookupTableDescriptor
      dicomTag(0x0028, 0x1102),  // GreenPaletteColorLookupTableDescriptor
      dicomTag(0x0028, 0x1103),  // BluePaletteColorLookupTableDescriptor
      dicomTag(0x0028, 0x1201),  // RedPaletteColorLookupTableData
      dicomTag(0x0028, 0x1202),  // GreenPaletteColorLookupTableData
      dicomTag(0x0028, 0x1203),  // BluePaletteColorLookupTableData
      dicomTag(0x0028, 0x1221),  // SegmentedRedPaletteColorLookupTableData
      dicomTag(0x0028, 0x1222),  // SegmentedGreenPaletteColorLookupTableData
      dicomTag(0x0028, 0x1223),  // SegmentedBluePaletteColorLookupTableData
      dicomTag(0x0054, 0x1001),  // Units
      dicomTag(0x0062, 0x0001),  // SegmentationType
      dicomTag(0x0062, 0x0004),  // SegmentNumber
      dicomTag(0x0062, 0x0005),  // SegmentLabel
      dicomTag(0x0062, 0x000b),  // ReferencedSegmentNumber
      dicomTag(0x0062, 0x000d),  // RecommendedDisplayCIELabValue
      dicomTag(0x0062, 0x000e),  // MaximumFractionalValue
      dicomTag(0x3004, 0x0002),  // DoseUnits
      dicomTag(0x3004, 0x000c),  // GridFrameOffsetVector
      dicomTag(0x3004, 0x000e),  // DoseGridScaling
  };
  return tags;
}

// Sequences that are looked into.
bool isKeptSequence(std::uint32_t tag) {
  constexpr std::array<std::uint32_t, 8> kSequences = {
      dicomTag(0x5200, 0x9229),  // SharedFunctionalGroupsSequence
      dicomTag(0x5200, 0x9230),  // PerFrameFunctionalGroupsSequence
      dicomTag(0x0020, 0x9113),  // PlanePositionSequence
      dicomTag(0x0020, 0x9116),  // PlaneOrientationSequence
      dicomTag(0x0028, 0x9110),  // PixelMeasuresSequence
      dicomTag(0x0028, 0x9145),  // PixelValueTransformationSequence
      dicomTag(0x0062, 0x0002),  // SegmentSequence
      dicomTag(0x0062, 0x000a),  // SegmentIdentificationSequence
  };
  return std::ranges::find(kSequences, tag) != kSequences.end();
}

bool isPixels(std::uint32_t tag) {
  return tag == dicomTag(0x7fe0, 0x0010) || tag == dicomTag(0x7fe0, 0x0008) || tag == dicomTag(0x7fe0, 0x0009);
}

std::string nameOf(std::uint32_t tag) { return fmt::format("({:04x},{:04x})", tag >> 16, tag & 0xffff); }

struct Element {
  std::uint32_t tag = 0;
  std::string vr;  // empty: the syntax does not say it
  std::uint32_t bytes = 0;
};

class DicomReader {
 public:
  explicit DicomReader(DicomBytes& file) : file_(file) { result_.name = file.name(); }

  DicomFile read() {
    std::string start(132, '\0');
    const bool has_preamble =
        file_.readSome(0, std::as_writable_bytes(std::span(start))) == start.size() && start.substr(128) == "DICM";
    at_ = has_preamble ? 132 : 0;
    readMeta();
    chooseSyntax(has_preamble);
    readSet(result_.set, file_.bytes(), 0);
    return std::move(result_);
  }

 private:
  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    failData("{}: {}", file_.name(), fmt::format(format, std::forward<Args>(args)...));
  }

  // Bytes of the file, a window of which is held.
  void get(std::uint64_t at, std::span<char> out) {
    if (at < window_begin_ || at + out.size() > window_begin_ + window_.size()) {
      window_.resize(std::max<std::size_t>(out.size(), std::size_t{1} << 16));
      window_begin_ = at;
      window_.resize(file_.readSome(at, std::as_writable_bytes(std::span(window_))));
      if (window_.size() < out.size()) fail("the file ends at byte {}, in an element", at + window_.size());
    }
    std::copy_n(window_.begin() + static_cast<std::ptrdiff_t>(at - window_begin_), out.size(), out.begin());
  }
  std::uint32_t number(std::size_t width) {
    std::array<char, 4> raw{};
    get(at_, std::span(raw).first(width));
    at_ += width;
    if (result_.is_big_endian) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(width));
    std::uint32_t value = 0;
    for (std::size_t i = width; i-- > 0;) value = value << 8 | static_cast<unsigned char>(raw[i]);
    return value;
  }
  std::uint32_t tag() {
    const std::uint32_t group = number(2);
    return dicomTag(group, number(2));
  }

  Element element() {
    Element result;
    result.tag = tag();
    const bool has_vr = is_explicit_ && result.tag >> 16 != 0xfffe;
    if (!has_vr) {
      result.bytes = number(4);
      return result;
    }
    result.vr.resize(2);
    get(at_, result.vr);
    at_ += 2;
    for (const char letter : result.vr) {
      if (letter < 'A' || letter > 'Z') fail("{} has no value representation at byte {}", nameOf(result.tag), at_ - 2);
    }
    constexpr std::string_view kLong = "OB OD OF OL OV OW SQ SV UC UN UR UT UV";
    if (kLong.find(result.vr) != std::string_view::npos) {
      at_ += 2;
      result.bytes = number(4);
    } else {
      result.bytes = number(2);
    }
    return result;
  }

  // Group 2 is explicit and little endian whatever follows.
  void readMeta() {
    is_explicit_ = true;
    while (at_ + 8 <= file_.bytes()) {
      const std::uint64_t begin = at_;
      std::array<char, 2> group{};
      get(at_, group);
      if (group[0] != 2 || group[1] != 0) break;
      const Element found = element();
      if (found.bytes == kUndefined || found.bytes > file_.bytes() - at_) {
        fail("{} at byte {} has {} bytes, the file has {}", nameOf(found.tag), begin, found.bytes, file_.bytes());
      }
      if (found.tag == dicomTag(0x0002, 0x0010)) keep(found, result_.set);
      at_ += found.bytes;
    }
    result_.transfer_syntax = result_.set.text(dicomTag(0x0002, 0x0010));
  }

  void chooseSyntax(bool has_preamble) {
    const std::string& syntax = result_.transfer_syntax;
    result_.is_big_endian = syntax == "1.2.840.10008.1.2.2";
    is_explicit_ = syntax != "1.2.840.10008.1.2";
    if (syntax == "1.2.840.10008.1.2.1.99") {
      result_.deflated_from = at_;
      file_.measureFrom(at_);
      window_.clear();
    }
    if (!syntax.empty()) return;
    if (has_preamble && at_ > 132) fail("TransferSyntaxUID: the element is missing");
    // Without one: two capitals where a value representation would be say that there are some.
    std::array<char, 6> start{};
    if (at_ + start.size() > file_.bytes()) fail("it is no DICOM file: it has no elements");
    get(at_, start);
    is_explicit_ = start[4] >= 'A' && start[4] <= 'Z' && start[5] >= 'A' && start[5] <= 'Z';
    result_.transfer_syntax = is_explicit_ ? "1.2.840.10008.1.2.1" : "1.2.840.10008.1.2";
  }

  void keep(const Element& found, DicomSet& set) {
    if (found.bytes > kMostValueBytes) {
      fail("{} has {} bytes, more than {}", nameOf(found.tag), found.bytes, kMostValueBytes);
    }
    kept_bytes_ += found.bytes + 64;
    if (kept_bytes_ > kMostKeptBytes)
      fail("{}: its elements take more than {} bytes", nameOf(found.tag), kMostKeptBytes);
    std::string value(found.bytes, '\0');
    get(at_, value);
    set.values[found.tag] = std::move(value);
  }

  // Up to `end`, or the end of an item.
  void readSet(DicomSet& set, std::uint64_t end, int depth) {
    if (depth > kMostDepth) fail("sequences lie {} deep, more than {}", depth, kMostDepth);
    while (at_ + 8 <= end) {
      const std::uint64_t begin = at_;
      const Element found = element();
      if (found.tag == kItemEnd) return;
      if (found.bytes != kUndefined && found.bytes > file_.bytes() - std::min(at_, file_.bytes())) {
        if (depth == 0 && isPixels(found.tag)) {
          fail("PixelData has {} bytes, {} are there", found.bytes, file_.bytes() - std::min(at_, file_.bytes()));
        }
        fail("{} at byte {} has {} bytes, the file has {}", nameOf(found.tag), begin, found.bytes, file_.bytes());
      }
      if (depth == 0 && isPixels(found.tag)) return takePixels(found);
      const bool is_sequence = found.vr == "SQ" || found.bytes == kUndefined || isKeptSequence(found.tag);
      if (is_sequence && (found.bytes == kUndefined || isKeptSequence(found.tag))) {
        readSequence(found, set, depth);
        continue;
      }
      if (keptTags().contains(found.tag)) keep(found, set);
      at_ += found.bytes;
    }
  }

  void readSequence(const Element& sequence, DicomSet& set, int depth) {
    const bool is_kept = isKeptSequence(sequence.tag);
    const std::uint64_t end = sequence.bytes == kUndefined ? file_.bytes() : at_ + sequence.bytes;
    // Of unknown representation and length, the items are implicit and little endian.
    const bool was_explicit = is_explicit_;
    if (sequence.vr == "UN") is_explicit_ = false;
    while (at_ + 8 <= end) {
      const Element item = element();
      if (item.tag == kSequenceEnd) break;
      if (item.tag != kItem) fail("{}: {} at byte {} is no item", nameOf(sequence.tag), nameOf(item.tag), at_ - 8);
      const std::uint64_t item_end = item.bytes == kUndefined ? end : at_ + item.bytes;
      if (item_end > end) fail("{}: an item ends behind its sequence, at byte {}", nameOf(sequence.tag), item_end);
      DicomSet unused;
      if (is_kept) set.items[sequence.tag].emplace_back();
      if (is_kept || item.bytes == kUndefined) {
        readSet(is_kept ? set.items[sequence.tag].back() : unused, item_end, depth + 1);
      }
      if (item.bytes != kUndefined) at_ = item_end;
      kept_bytes_ += is_kept ? 128 : 0;
      if (kept_bytes_ > kMostKeptBytes) fail("{}: it takes more than {} bytes", nameOf(sequence.tag), kMostKeptBytes);
    }
    is_explicit_ = was_explicit;
  }

  void takePixels(const Element& found) {
    result_.has_pixels = true;
    result_.is_float = found.tag != dicomTag(0x7fe0, 0x0010);
    if (found.bytes != kUndefined) {
      result_.pieces.push_back({.begin = at_, .bytes = found.bytes});
      return;
    }
    result_.is_packed = true;
    bool is_table = true;
    while (at_ + 8 <= file_.bytes()) {
      const Element item = element();
      if (item.tag == kSequenceEnd) return;
      if (item.tag != kItem || item.bytes == kUndefined || item.bytes > file_.bytes() - at_) {
        fail("PixelData: {} at byte {} is no fragment that the file holds", nameOf(item.tag), at_ - 8);
      }
      if (is_table) {
        readOffsets(item);
      } else {
        result_.pieces.push_back({.begin = at_, .bytes = item.bytes});
      }
      is_table = false;
      at_ += item.bytes;
    }
  }

  void readOffsets(const Element& item) {
    if (item.bytes % 4 != 0 || item.bytes > kMostValueBytes) fail("PixelData: an offset table of {} bytes", item.bytes);
    const std::uint64_t begin = at_;
    for (std::uint32_t i = 0; i < item.bytes / 4; ++i) result_.offsets.push_back(number(4));
    at_ = begin;
  }

  DicomBytes& file_;
  DicomFile result_;
  std::uint64_t at_ = 0;
  bool is_explicit_ = true;
  std::string window_;
  std::uint64_t window_begin_ = 0;
  std::uint64_t kept_bytes_ = 0;
};

}  // namespace

std::string DicomSet::text(std::uint32_t tag) const {
  const auto found = values.find(tag);
  if (found == values.end()) return {};
  std::string_view value = found->second;
  while (!value.empty() && (value.back() == '\0' || value.back() == ' ')) value.remove_suffix(1);
  return std::string(trimmed(value));
}

const DicomSet* DicomSet::item(std::uint32_t sequence, std::size_t index) const {
  const auto found = items.find(sequence);
  return found == items.end() || index >= found->second.size() ? nullptr : &found->second[index];
}

std::optional<std::int64_t> DicomFile::whole(const DicomSet& from, std::uint32_t tag) const {
  const auto found = from.values.find(tag);
  if (found == from.values.end() || found->second.empty()) return std::nullopt;
  const std::string& bytes = found->second;
  if (bytes.size() < 2) failData("{}: {} has {} bytes, not 2", name, nameOf(tag), bytes.size());
  const auto first = static_cast<unsigned char>(bytes[is_big_endian ? 1 : 0]);
  const auto second = static_cast<unsigned char>(bytes[is_big_endian ? 0 : 1]);
  return first | second << 8;
}

std::vector<int> DicomFile::wholes(const DicomSet& from, std::uint32_t tag) const {
  std::vector<int> result;
  const auto found = from.values.find(tag);
  if (found == from.values.end()) return result;
  const std::string& bytes = found->second;
  for (std::size_t i = 0; i + 2 <= bytes.size(); i += 2) {
    const auto first = static_cast<unsigned char>(bytes[i + (is_big_endian ? 1 : 0)]);
    const auto second = static_cast<unsigned char>(bytes[i + (is_big_endian ? 0 : 1)]);
    result.push_back(first | second << 8);
  }
  return result;
}

std::vector<double> DicomFile::reals(const DicomSet& from, std::uint32_t tag) const {
  std::vector<double> result;
  const std::string text = from.text(tag);
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\\', begin), text.size());
    const auto value = parseReal(trimmed(std::string_view(text).substr(begin, end - begin)));
    if (!value || !std::isfinite(*value)) {
      failData("{}: {}: '{}' is no finite number", name, nameOf(tag),
               text.substr(begin, std::min<std::size_t>(end - begin, 40)));
    }
    result.push_back(*value);
    begin = end + 1;
  }
  return result;
}

bool startsLikeDicom(std::string_view start) { return start.size() >= 132 && start.substr(128, 4) == "DICM"; }

// An element of group 8 that is one of its first, with a length that is no longer than one is.
bool startsLikeBareDicom(std::string_view start) {
  if (start.size() < 8 || start[0] != 8 || start[1] != 0 || start[3] != 0) return false;
  const auto element = static_cast<unsigned char>(start[2]);
  if (element != 0 && element != 1 && element != 5 && element != 8 && element != 0x12 && element != 0x16) return false;
  const bool has_vr = start[4] >= 'A' && start[4] <= 'Z' && start[5] >= 'A' && start[5] <= 'Z';
  return has_vr || (start[5] == 0 && start[6] == 0 && start[7] == 0);
}

DicomFile readDicomFile(DicomBytes& file) { return DicomReader(file).read(); }

}  // namespace blockwalk
