// SPDX-License-Identifier: Apache-2.0
#include "volume/import/dicom/dicom_segments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "volume/error.h"
#include "volume/import/convert/channel.h"
#include "volume/import/dicom/dicom_frames.h"
#include "volume/import/dicom/segment_places.h"
#include "volume/import/frame.h"
#include "volume/import/source_facts.h"
#include "volume/plain_text.h"

namespace blockwalk {
namespace {

// Text as the data set's characters are, those beyond ASCII of Latin 1 and UTF-8.
std::string decoded(const std::string& text, const std::string& characters) {
  if (isPlainText(text) || characters != "ISO_IR 100") return plainText(text);
  std::string result;
  for (const char byte : text) {
    const auto code = static_cast<unsigned char>(byte);
    if (code < 0x80) result += byte;
    if (code >= 0x80) result += {static_cast<char>(0xc0 | code >> 6), static_cast<char>(0x80 | (code & 0x3f))};
  }
  return plainText(result);
}

// CIELab of D50 (PS3.3, C.10.7.1.1) as sRGB, whose white is D65: the matrix has Bradford's adaptation in it.
Color colorOfLab(double lightness, double a, double b) {
  const auto back = [](double f) {
    constexpr double kKnee = 6.0 / 29;
    return f > kKnee ? f * f * f : 3 * kKnee * kKnee * (f - 4.0 / 29);
  };
  const double f = (lightness + 16) / 116;
  const glm::dvec3 xyz(0.9642 * back(f + a / 500), back(f), 0.8249 * back(f - b / 200));
  constexpr std::array<std::array<double, 3>, 3> kRgbFromXyz = {
      {{3.1338561, -1.6168667, -0.4906146}, {-0.9787684, 1.9161415, 0.0334540}, {0.0719453, -0.2289914, 1.4052427}}};
  Color color{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& row = kRgbFromXyz[i];
    const double linear = std::clamp(row[0] * xyz.x + row[1] * xyz.y + row[2] * xyz.z, 0.0, 1.0);
    const double shown = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
    color[i] = static_cast<std::uint8_t>(std::lround(255 * shown));
  }
  return color;
}

class SegmentSource final : public Source {
 public:
  // `numbers`: the segments that are read, all but of a choice; of fractions those of the channels.
  SegmentSource(DicomImage image, SegmentPlaces places, std::vector<int> numbers, SourceInfo info,
                std::uint64_t memory_bytes)
      : image_(std::move(image)),
        places_(std::move(places)),
        numbers_(std::move(numbers)),
        info_(std::move(info)),
        file_(openDicomBytes(image_)),
        memory_bytes_(memory_bytes) {}

  const SourceInfo& info() const override { return info_; }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const std::size_t row = channelRowBytes(info_);
    const std::size_t plane = row * static_cast<std::size_t>(info_.dims.y);
    const std::size_t part = row * static_cast<std::size_t>(count);
    BLOCKWALK_CHECK(out.size(), ==, part * info_.channels.size());
    if (z != z_) compose(z);
    for (std::size_t c = 0; c < info_.channels.size(); ++c) {
      std::memcpy(&out[c * part], &slice_[c * plane + static_cast<std::size_t>(y) * row], part);
    }
  }

  // In how many voxels of how many slices segments overlap.
  std::array<std::uint64_t, 2> overlaps() {
    std::array<std::uint64_t, 2> result{};
    for (int z = 0; z < info_.dims.z && is_labels(); ++z) {
      if (places_.slices[static_cast<std::size_t>(z)].size() < 2) continue;
      const std::uint64_t voxels = compose(z);
      result[0] += voxels;
      result[1] += voxels > 0 ? 1 : 0;
    }
    return result;
  }

 private:
  bool is_labels() const { return info_.channels[0].is_labels; }

  // Returns in how many voxels more than one segment is.
  std::uint64_t compose(int z) {
    z_ = -1;
    const std::size_t voxels = static_cast<std::size_t>(info_.dims.x) * static_cast<std::size_t>(info_.dims.y);
    slice_.assign(voxels * voxelBytes(info_.type) * info_.channels.size(), std::byte{0});
    std::uint64_t overlaps = 0;
    for (const DicomFrame& frame : places_.slices[static_cast<std::size_t>(z)]) {
      const auto chosen = std::ranges::find(numbers_, frame.segment);
      if (frame.segment > 0 && chosen == numbers_.end()) continue;
      const std::vector<std::byte> pixels = readDicomFrame(image_, frame.index, file_, memory_bytes_);
      const std::size_t channel = is_labels() ? 0 : static_cast<std::size_t>(chosen - numbers_.begin());
      for (std::size_t i = 0; i < voxels; ++i) {
        const std::uint16_t value = valueOf(pixels, i, frame.segment);
        if (value == 0) continue;
        overlaps += put(channel * voxels + i, value) ? 1 : 0;
      }
    }
    z_ = z;
    return overlaps;
  }

  // 0: nothing is there.
  std::uint16_t valueOf(std::span<const std::byte> pixels, std::size_t i, int segment) const {
    std::uint16_t value = 0;
    if (image_.pixels.bits_allocated == 16) {
      std::memcpy(&value, &pixels[2 * i], 2);
    } else {
      value = std::to_integer<std::uint8_t>(pixels[i]);
    }
    if (!is_labels() || value == 0) return value;
    if (segment > 0) return static_cast<std::uint16_t>(segment);
    return numbers_.empty() || std::ranges::find(numbers_, int{value}) != numbers_.end() ? value : 0;
  }

  // Returns whether another segment was there.
  bool put(std::size_t at, std::uint16_t value) {
    const std::size_t bytes = voxelBytes(info_.type);
    std::uint16_t before = 0;
    std::memcpy(&before, &slice_[at * bytes], bytes);
    std::memcpy(&slice_[at * bytes], &value, bytes);
    return before != 0 && before != value;
  }

  DicomImage image_;
  SegmentPlaces places_;
  std::vector<int> numbers_;
  SourceInfo info_;
  DicomBytes file_;
  std::uint64_t memory_bytes_;
  int z_ = -1;
  std::vector<std::byte> slice_;  // channel after channel
};

// The segment that --dataset names, else all; of LABELMAP none says that all are.
std::vector<LabelInfo> chosenSegments(const DicomImage& image, const ImportOptions& options) {
  if (!options.dataset) return image.segments;
  std::string list;
  for (const LabelInfo& segment : image.segments) {
    if (segment.name == *options.dataset) return {segment};
  }
  for (const LabelInfo& segment : image.segments) {
    if (fmt::format("{}", segment.value) == *options.dataset) return {segment};
    if (list.size() < 4096) list += fmt::format("\n  --dataset {}: {}", segment.value, segment.name);
  }
  failData("{}: --dataset {}: there is no such segment; there are{}", image.name, *options.dataset, list);
}

SourceChannel labelsOf(const std::vector<LabelInfo>& segments, std::vector<std::string>& notes) {
  constexpr std::size_t kMostBytes = std::size_t{512} << 10;
  SourceChannel channel;
  channel.is_labels = true;
  std::size_t bytes = 0;
  for (const LabelInfo& segment : segments) {
    bytes += 64 + segment.name.size();
    if (bytes > kMostBytes) {
      notes.push_back(fmt::format("of {} segments the first {} keep their names and colours", segments.size(),
                                  channel.labels.size()));
      break;
    }
    channel.labels.push_back(segment);
  }
  return channel;
}

SourceChannel fractionOf(const LabelInfo& segment, int full) {
  SourceChannel channel{.name = segment.name, .value_scale = 1.0 / full};
  channel.color = segment.color;
  if (channel.name.size() > kMaxChannelNameBytes) channel.name.resize(kMaxChannelNameBytes);
  while (!isPlainText(channel.name)) channel.name.pop_back();  // cut in a character
  return channel;
}

void describeValues(const DicomImage& image, std::vector<LabelInfo>& segments, SourceInfo& info) {
  if (image.segmentation != "FRACTIONAL") {
    double most = image.segmentation == "LABELMAP" && image.pixels.bits_allocated == 16 ? 65535 : 0;
    for (const LabelInfo& segment : segments) most = std::max(most, segment.value);
    info.type = most > 255 ? VoxelType::u16 : VoxelType::u8;
    info.channels = {labelsOf(segments, info.notes)};
    return;
  }
  if (segments.size() > kMaxChannels) {
    info.notes.push_back(fmt::format("of {} segments, which are fractions, it has the first {}; --dataset chooses one",
                                     segments.size(), kMaxChannels));
    segments.resize(kMaxChannels);
  }
  info.channels.clear();
  for (const LabelInfo& segment : segments) info.channels.push_back(fractionOf(segment, image.full_fraction));
}

}  // namespace

std::vector<LabelInfo> readDicomSegments(const DicomFile& file) {
  std::vector<LabelInfo> segments;
  const auto items = file.set.items.find(dicomTag(0x0062, 0x0002));
  if (items == file.set.items.end()) return segments;
  const std::string characters = file.set.text(dicomTag(0x0008, 0x0005));
  for (const DicomSet& item : items->second) {
    const auto number = file.whole(item, dicomTag(0x0062, 0x0004));
    if (!number) failData("{}: SegmentSequence: SegmentNumber: the element is missing", file.name);
    LabelInfo segment{.value = static_cast<double>(*number),
                      .name = decoded(item.text(dicomTag(0x0062, 0x0005)).substr(0, 512), characters)};
    const auto lab = file.wholes(item, dicomTag(0x0062, 0x000d));
    if (lab.size() >= 3) {
      segment.color = colorOfLab(lab[0] * 100.0 / 65535, lab[1] * 255.0 / 65535 - 128, lab[2] * 255.0 / 65535 - 128);
    }
    segments.push_back(std::move(segment));
  }
  std::ranges::stable_sort(segments, {}, &LabelInfo::value);
  const auto twice = std::ranges::adjacent_find(segments, {}, &LabelInfo::value);
  if (twice != segments.end()) failData("{}: SegmentNumber: {} comes twice", file.name, twice->value);
  return segments;
}

std::unique_ptr<Source> openDicomSegments(DicomSeries series, const std::string& name, const ImportOptions& options) {
  if (series.images.size() > 1) {
    failData("{}: holds {} segmentations, {} and {} among them; name one file", name, series.images.size(),
             series.images[0].name, series.images[1].name);
  }
  DicomImage image = std::move(series.images.front());
  SourceInfo info{.name = name, .format = "dicom", .notes = std::move(series.notes)};
  chosenFrame(options, 1, name, "NumberOfFrames", info.notes);
  SegmentPlaces places = placeSegments(image, name, info.notes);
  info.dims =
      checkedDims(image.pixels.width, image.pixels.height, std::ssize(places.slices), name, "Columns, Rows, frames");
  info.world_from_index = worldFromIndex(places.geometry, options.spacing, name,
                                         "PixelSpacing, ImageOrientationPatient, ImagePositionPatient");
  tellSpacing(options.spacing, dicomSpacingFields(image, places.slices.size(), places.has_place), info);
  tellRead(image.frames.size(), "frame", 1, info);
  if (places.has_place) info.space = "left-posterior-superior";
  if (places.has_place || image.spacing) info.length_unit = "mm";
  if (!image.modality.empty() && image.modality.size() <= 16) info.facts.emplace_back("modality", image.modality);
  std::vector<LabelInfo> segments = chosenSegments(image, options);
  describeValues(image, segments, info);
  nameChannels(info, options);
  const std::uint64_t slice = channelRowBytes(info) * static_cast<std::uint64_t>(info.dims.y) * info.channels.size();
  if (slice > options.memory_bytes) {
    failData("{}: Rows and Columns: a slice takes {} bytes of memory, {} are allowed; raise --memory", name, slice,
             options.memory_bytes);
  }
  std::vector<int> numbers;
  const bool are_all = image.segmentation == "LABELMAP" && !options.dataset;
  for (std::size_t i = 0; i < segments.size() && !are_all; ++i) numbers.push_back(static_cast<int>(segments[i].value));
  const auto open = [&](SourceInfo described) {
    return std::make_unique<SegmentSource>(image, places, numbers, std::move(described), options.memory_bytes);
  };
  const auto [voxels, slices] = open(info)->overlaps();
  if (voxels > 0) {
    info.notes.push_back(
        fmt::format("segments overlap in {} voxels of {} slices: the one of the greatest number is seen there; "
                    "--dataset chooses one",
                    voxels, slices));
  }
  return open(std::move(info));
}

}  // namespace blockwalk
