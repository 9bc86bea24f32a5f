// SPDX-License-Identifier: Apache-2.0
#include "volume/import/dicom/dicom_image.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "volume/error.h"
#include "volume/import/dicom/dicom_segments.h"
#include "volume/import/header_text.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

class DicomImageReader {
 public:
  DicomImageReader(DicomFile file, const std::filesystem::path& path) : file_(std::move(file)) {
    image_.name = file_.name;
    image_.path = path;
  }

  DicomImage read() {
    const DicomSet& set = file_.set;
    image_.series = set.text(dicomTag(0x0020, 0x000e));
    image_.modality = set.text(dicomTag(0x0008, 0x0060));
    image_.transfer_syntax = file_.transfer_syntax;
    image_.is_big_endian = file_.is_big_endian;
    image_.deflated_from = file_.deflated_from;
    image_.is_packed = file_.is_packed;
    readPixels();
    readSegments();
    readPlane();
    readFrames();
    readUnit();
    takePieces();
    return std::move(image_);
  }

 private:
  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    failData("{}: {}", file_.name, fmt::format(format, std::forward<Args>(args)...));
  }

  int whole(std::uint32_t tag, const char* name, std::optional<int> absent, int least, int most) const {
    const auto value = file_.whole(file_.set, tag);
    if (!value && absent) return *absent;
    if (!value) fail("{}: the element is missing", name);
    if (*value < least || *value > most) fail("{}: {} is outside {}..{}", name, *value, least, most);
    return static_cast<int>(*value);
  }

  void readPixels() {
    DicomPixels& pixels = image_.pixels;
    pixels.height = whole(dicomTag(0x0028, 0x0010), "Rows", std::nullopt, 1, kMaxDim - 1);
    pixels.width = whole(dicomTag(0x0028, 0x0011), "Columns", std::nullopt, 1, kMaxDim - 1);
    pixels.samples = whole(dicomTag(0x0028, 0x0002), "SamplesPerPixel", 1, 1, 3);
    pixels.bits_allocated = whole(dicomTag(0x0028, 0x0100), "BitsAllocated", std::nullopt, 1, 64);
    const bool is_bit = pixels.bits_allocated == 1;
    if (!is_bit && (pixels.bits_allocated % 8 != 0 || pixels.bits_allocated == 24)) {
      fail("BitsAllocated: {} cannot be read; 1, 8, 16, 32 and 64 can", pixels.bits_allocated);
    }
    if (is_bit && file_.is_packed) fail("BitsAllocated: 1 cannot be read of packed pixels");
    pixels.is_float = file_.is_float;
    if (pixels.is_float ? pixels.bits_allocated < 32 : pixels.bits_allocated > 32) {
      fail("BitsAllocated: {} with {} pixels cannot be read", pixels.bits_allocated,
           pixels.is_float ? "floating-point" : "whole");
    }
    pixels.bits_stored = whole(dicomTag(0x0028, 0x0101), "BitsStored", pixels.bits_allocated, 1, pixels.bits_allocated);
    pixels.high_bit = whole(dicomTag(0x0028, 0x0102), "HighBit", pixels.bits_stored - 1, pixels.bits_stored - 1,
                            pixels.bits_allocated - 1);
    pixels.is_signed = whole(dicomTag(0x0028, 0x0103), "PixelRepresentation", 0, 0, 1) == 1;
    pixels.is_planar = whole(dicomTag(0x0028, 0x0006), "PlanarConfiguration", 0, 0, 1) == 1 && pixels.samples > 1;
    readPhotometric();
  }

  void readPhotometric() {
    DicomPixels& pixels = image_.pixels;
    const std::string text = file_.set.text(dicomTag(0x0028, 0x0004));
    const bool is_grey = text == "MONOCHROME1" || text == "MONOCHROME2" || text.empty();
    const bool is_jpeg_color = text == "YBR_FULL_422" || text == "YBR_ICT" || text == "YBR_RCT";
    const bool is_palette = text == "PALETTE COLOR" && pixels.bits_allocated <= 16 && pixels.bits_allocated >= 8;
    const bool is_color = text == "RGB" || text == "YBR_FULL" || (is_jpeg_color && file_.is_packed);
    if (pixels.samples == 1 ? !is_grey && !is_palette : !is_color || pixels.samples != 3) {
      fail("PhotometricInterpretation: {} with {} samples a pixel cannot be read", text, pixels.samples);
    }
    if (pixels.samples == 3 && (pixels.bits_allocated > 16 || pixels.bits_allocated < 8 || pixels.is_signed)) {
      fail("BitsAllocated: {} of a colour cannot be read; 8 and 16 can", pixels.bits_allocated);
    }
    if (is_palette) {
      image_.palette = readDicomPalette(file_, pixels.is_signed);
      pixels.palette_bits = image_.palette->bits;
    }
    pixels.is_inverted = text == "MONOCHROME1";
    // JPEG 2000 turns its own kinds back by itself.
    pixels.is_ybr = (text == "YBR_FULL" || text == "YBR_FULL_422") && pixels.bits_allocated == 8;
  }

  void readSegments() {
    image_.segmentation = file_.set.text(dicomTag(0x0062, 0x0001));
    if (image_.segmentation.empty()) return;
    if (image_.segmentation != "BINARY" && image_.segmentation != "FRACTIONAL" && image_.segmentation != "LABELMAP") {
      fail("SegmentationType: {} cannot be read", image_.segmentation.substr(0, 16));
    }
    const DicomPixels& pixels = image_.pixels;
    const int most_bits = image_.segmentation == "BINARY" ? 1 : image_.segmentation == "FRACTIONAL" ? 8 : 16;
    if (pixels.format().channels != 1 || pixels.bits_allocated > most_bits || pixels.is_signed) {
      fail("BitsAllocated: {} of a segmentation that is {} cannot be read", pixels.bits_allocated, image_.segmentation);
    }
    image_.segments = readDicomSegments(file_);
    image_.full_fraction = whole(dicomTag(0x0062, 0x000e), "MaximumFractionalValue", 255, 1, 255);
  }

  // Of a frame: the one that it names, or the only one that there is.
  int segmentOf(std::size_t frame) const {
    if (image_.segmentation.empty() || image_.segmentation == "LABELMAP") return 0;
    const DicomSet* said = group(frame, dicomTag(0x0062, 0x000a));
    const auto number = said != nullptr ? file_.whole(*said, dicomTag(0x0062, 0x000b)) : std::nullopt;
    if (!number && image_.segments.size() == 1) return static_cast<int>(image_.segments[0].value);
    const bool is_known = number && std::ranges::any_of(image_.segments, [&](const LabelInfo& segment) {
                            return segment.value == static_cast<double>(*number);
                          });
    if (!is_known) {
      fail("ReferencedSegmentNumber: frame {} is of segment {}, which SegmentSequence has not", frame + 1,
           number ? fmt::format("{}", *number) : "(not said)");
    }
    return static_cast<int>(*number);
  }

  // The functional group of a frame, or of all.
  const DicomSet* group(std::size_t frame, std::uint32_t sequence) const {
    for (const auto& [groups, index] :
         {std::pair(dicomTag(0x5200, 0x9230), frame), std::pair(dicomTag(0x5200, 0x9229), std::size_t{0})}) {
      const DicomSet* set = file_.set.item(groups, index);
      const DicomSet* found = set != nullptr ? set->item(sequence) : nullptr;
      if (found != nullptr) return found;
    }
    return nullptr;
  }

  std::vector<double> reals(const DicomSet* set, std::uint32_t tag, std::size_t count, const char* name) const {
    if (set == nullptr) return {};
    auto values = file_.reals(*set, tag);
    if (!values.empty() && values.size() < count) fail("{}: {} numbers, not {}", name, values.size(), count);
    return values;
  }

  // Of one number: the frame's, or the data set's own.
  double real(const DicomSet* set, std::uint32_t tag, const char* name, double absent) const {
    const auto own = reals(set, tag, 1, name);
    if (!own.empty()) return own[0];
    const auto all = reals(&file_.set, tag, 1, name);
    return all.empty() ? absent : all[0];
  }

  void readFrames() {
    const auto said = reals(&file_.set, dicomTag(0x0028, 0x0008), 1, "NumberOfFrames");
    const double count = said.empty() ? 1 : said[0];
    if (!(count >= 1) || count > kMaxDim || count != std::floor(count)) {
      fail("NumberOfFrames: {} is outside 1..{}", count, kMaxDim);
    }
    const auto number = reals(&file_.set, dicomTag(0x0020, 0x0013), 1, "InstanceNumber");
    const auto offsets = reals(&file_.set, dicomTag(0x3004, 0x000c), 1, "GridFrameOffsetVector");
    const double dose = real(nullptr, dicomTag(0x3004, 0x000e), "DoseGridScaling", 1);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      DicomFrame frame;
      frame.index = i;
      frame.segment = segmentOf(i);
      frame.number = number.empty() || std::fabs(number[0]) > 1e15 ? 0 : static_cast<std::int64_t>(number[0]);
      const auto place = positionOf(i);
      frame.has_position = place.size() >= 3;
      if (frame.has_position) frame.position = glm::dvec3(place[0], place[1], place[2]);
      const DicomSet* values = group(i, dicomTag(0x0028, 0x9145));
      frame.slope = real(values, dicomTag(0x0028, 0x1053), "RescaleSlope", dose);
      frame.intercept = real(values, dicomTag(0x0028, 0x1052), "RescaleIntercept", 0);
      if (frame.slope == 0) fail("RescaleSlope: 0 would make all values one");
      image_.frames.push_back(frame);
    }
    readDirections();
    spreadFrames(offsets);
  }

  std::vector<double> positionOf(std::size_t frame) const {
    const auto own = reals(group(frame, dicomTag(0x0020, 0x9113)), dicomTag(0x0020, 0x0032), 3, "ImagePositionPatient");
    return own.empty() ? reals(&file_.set, dicomTag(0x0020, 0x0032), 3, "ImagePositionPatient") : own;
  }

  void readDirections() {
    auto values = reals(group(0, dicomTag(0x0020, 0x9116)), dicomTag(0x0020, 0x0037), 6, "ImageOrientationPatient");
    if (values.empty()) values = reals(&file_.set, dicomTag(0x0020, 0x0037), 6, "ImageOrientationPatient");
    if (values.empty()) return;
    const glm::dvec3 row(values[0], values[1], values[2]);
    const glm::dvec3 column(values[3], values[4], values[5]);
    const double area = glm::length(glm::cross(row, column));
    if (!(area > 0.5)) fail("ImageOrientationPatient: rows and columns do not span a plane");
    image_.directions = {glm::normalize(row), glm::normalize(column)};
  }

  // Frames of one file that have one position: they lie behind each other, as far apart as the file says.
  void spreadFrames(const std::vector<double>& offsets) {
    const bool own = file_.set.items.contains(dicomTag(0x5200, 0x9230));
    const DicomSet* measures = group(0, dicomTag(0x0028, 0x9110));
    image_.thickness = std::fabs(real(measures, dicomTag(0x0018, 0x0088), "SpacingBetweenSlices", 0));
    image_.is_step_said = image_.thickness > 0;
    if (image_.thickness == 0) {
      image_.thickness = std::fabs(real(measures, dicomTag(0x0018, 0x0050), "SliceThickness", 0));
    }
    if (image_.frames.size() < 2 || own || !image_.directions || !image_.frames[0].has_position) return;
    if (image_.thickness == 0 && offsets.size() != image_.frames.size()) {
      image_.thickness = image_.spacing.value_or(glm::dvec2(1)).x;
      image_.is_thickness_guessed = true;
    }
    const bool has_offsets = offsets.size() == image_.frames.size();
    image_.step_field = has_offsets           ? "GridFrameOffsetVector"
                        : image_.is_step_said ? "SpacingBetweenSlices"
                                              : "SliceThickness";
    const glm::dvec3 normal = glm::cross((*image_.directions)[0], (*image_.directions)[1]);
    for (std::size_t i = 0; i < image_.frames.size(); ++i) {
      const double along = has_offsets ? offsets[i] - offsets[0] : image_.thickness * static_cast<double>(i);
      image_.frames[i].position += normal * along;
    }
  }

  void readPlane() {
    auto values = reals(group(0, dicomTag(0x0028, 0x9110)), dicomTag(0x0028, 0x0030), 2, "PixelSpacing");
    if (values.empty()) values = reals(&file_.set, dicomTag(0x0028, 0x0030), 2, "PixelSpacing");
    if (values.empty()) values = reals(&file_.set, dicomTag(0x0018, 0x1164), 2, "ImagerPixelSpacing");
    if (values.empty()) return;
    if (!(values[0] > 0) || !(values[1] > 0)) fail("PixelSpacing: {} and {} must be above 0", values[0], values[1]);
    image_.spacing = glm::dvec2(values[1], values[0]);  // the first is from row to row
  }

  void readUnit() {
    const DicomSet* values = group(0, dicomTag(0x0028, 0x9145));
    std::string type = values != nullptr ? values->text(dicomTag(0x0028, 0x1054)) : "";
    if (type.empty()) type = file_.set.text(dicomTag(0x0028, 0x1054));
    if (type == "US") type.clear();  // not specified
    if (type.empty() && image_.modality == "CT") type = "HU";
    if (type.empty()) type = file_.set.text(dicomTag(0x0054, 0x1001));
    if (type.empty() && lowerCase(file_.set.text(dicomTag(0x3004, 0x0002))) == "gy") type = "Gy";
    if (type.size() <= kMaxUnitBytes) image_.unit = type;
  }

  void takePieces() {
    const std::size_t count = image_.frames.size();
    if (file_.is_packed) return takeFragments(count);
    const bool is_bit = image_.pixels.bits_allocated == 1;
    const std::uint64_t pixels = image_.pixels.frameBytes();
    const std::uint64_t needed = is_bit ? (pixels * count + 7) / 8 : pixels * count;
    if (file_.pieces[0].bytes < needed) {
      fail("PixelData: {} bytes are there, {} frames of {} x {} need {}", file_.pieces[0].bytes, count,
           image_.pixels.width, image_.pixels.height, needed);
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint64_t begin = is_bit ? i * pixels / 8 : i * pixels;
      const std::uint64_t end = is_bit ? ((i + 1) * pixels + 7) / 8 : (i + 1) * pixels;
      image_.pieces.push_back({{.begin = file_.pieces[0].begin + begin, .bytes = end - begin}});
    }
  }

  void takeFragments(std::size_t count) {
    const auto& fragments = file_.pieces;
    if (fragments.empty()) fail("PixelData: it has no fragments");
    if (fragments.size() == count) {
      for (const DicomPiece& fragment : fragments) image_.pieces.push_back({fragment});
      return;
    }
    if (count == 1) {
      image_.pieces.push_back(fragments);
      return;
    }
    if (file_.offsets.size() != count) fail("PixelData: {} fragments of {} frames", fragments.size(), count);
    image_.pieces.resize(count);
    std::size_t frame = 0;
    for (const DicomPiece& fragment : fragments) {
      const std::uint64_t offset = fragment.begin - fragments[0].begin;
      while (frame + 1 < count && offset >= file_.offsets[frame + 1]) ++frame;
      image_.pieces[frame].push_back(fragment);
    }
    for (const auto& pieces : image_.pieces) {
      if (pieces.empty()) fail("PixelData: a frame has no fragment");
    }
  }

  DicomFile file_;
  DicomImage image_;
};

}  // namespace

SampleFormat DicomPixels::format() const {
  if (palette_bits > 0) return {.type = palette_bits == 8 ? SampleType::u8 : SampleType::u16, .channels = 3};
  return storedFormat();
}

SampleFormat DicomPixels::storedFormat() const {
  SampleFormat result{.channels = samples};
  const std::array<SampleType, 3> kinds =
      bits_allocated <= 8    ? std::array{SampleType::u8, SampleType::i8, SampleType::f32}
      : bits_allocated == 16 ? std::array{SampleType::u16, SampleType::i16, SampleType::f32}
      : bits_allocated == 32 ? std::array{SampleType::u32, SampleType::i32, SampleType::f32}
                             : std::array{SampleType::u64, SampleType::i64, SampleType::f64};
  result.type = is_float ? kinds[2] : is_signed ? kinds[1] : kinds[0];
  return result;
}

std::optional<DicomImage> readDicomImage(const std::filesystem::path& path) {
  DicomBytes bytes(path);
  DicomFile file = readDicomFile(bytes);
  if (!file.has_pixels) return std::nullopt;
  return DicomImageReader(std::move(file), path).read();
}

}  // namespace blockwalk
