// SPDX-License-Identifier: Apache-2.0
// DICOM: a series of files, or the frames of one.
#include <algorithm>
#include <cstring>
#include <optional>
#include <set>
#include <utility>

#include "volume/error.h"
#include "volume/import/convert/channel.h"
#include "volume/import/dicom/dicom_frames.h"
#include "volume/import/dicom/dicom_segments.h"
#include "volume/import/dicom/dicom_series.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

bool haveOneScale(const DicomSeries& series) {
  const DicomFrame& first = series.frames.front();
  return std::ranges::all_of(series.frames, [&](const DicomFrame& frame) {
    return frame.slope == first.slope && frame.intercept == first.intercept;
  });
}

double sampleAt(const std::byte* at, SampleType type) {
  const auto load = [&](auto value) {
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  };
  switch (type) {
    case SampleType::u8:
      return load(std::uint8_t{});
    case SampleType::i8:
      return load(std::int8_t{});
    case SampleType::u16:
      return load(std::uint16_t{});
    case SampleType::i16:
      return load(std::int16_t{});
    case SampleType::u32:
      return load(std::uint32_t{});
    case SampleType::i32:
      return load(std::int32_t{});
    case SampleType::f32:
      return load(float{});
    default:
      return load(double{});
  }
}

class DicomSource final : public Source {
 public:
  DicomSource(DicomSeries series, SourceInfo info, ChannelConverter converter, bool is_scaled,
              std::uint64_t memory_bytes)
      : series_(std::move(series)),
        info_(std::move(info)),
        converter_(std::move(converter)),
        is_scaled_(is_scaled),
        memory_bytes_(memory_bytes) {}

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    BLOCKWALK_CHECK(out.size(), ==, channelRowBytes(info_) * info_.channels.size() * static_cast<std::size_t>(count));
    const DicomFrame& frame = series_.frames[static_cast<std::size_t>(z)];
    if (z != z_) {
      frame_.clear();
      const DicomImage& image = series_.images[frame.file];
      // Of a file that is deflated the next frame comes behind the last.
      if (!file_ || frame.file != open_) file_.emplace(openDicomBytes(image));
      open_ = frame.file;
      frame_ = readDicomFrame(image, frame.index, *file_, memory_bytes_);
      z_ = z;
    }
    const std::size_t row = frame_.size() / static_cast<std::size_t>(info_.dims.y);
    const auto rows =
        std::span(frame_).subspan(static_cast<std::size_t>(y) * row, static_cast<std::size_t>(count) * row);
    samples_.assign(rows.begin(), rows.end());
    if (is_scaled_) scale(frame);
    converter_.convert(samples_, 0, out);
  }

 private:
  // Each frame has a scale of its own: what is stored are values.
  void scale(const DicomFrame& frame) {
    const SampleType type = series_.images[frame.file].pixels.format().type;
    const std::size_t count = samples_.size() / sampleBytes(type);
    std::vector<std::byte> scaled(count * sizeof(double));
    for (std::size_t i = 0; i < count; ++i) {
      const double value = frame.intercept + frame.slope * sampleAt(&samples_[i * sampleBytes(type)], type);
      std::memcpy(&scaled[i * sizeof value], &value, sizeof value);
    }
    samples_ = std::move(scaled);
  }

  DicomSeries series_;
  SourceInfo info_;
  ChannelConverter converter_;
  bool is_scaled_;
  std::uint64_t memory_bytes_;
  std::optional<DicomBytes> file_;  // number `open_`
  std::size_t open_ = 0;
  int z_ = -1;
  std::vector<std::byte> frame_;
  std::vector<std::byte> samples_;
};

}  // namespace

std::unique_ptr<Source> openDicom(const std::vector<std::filesystem::path>& paths, const std::string& name,
                                  const ImportOptions& options) {
  DicomSeries series = openDicomSeries(paths, name, options);
  if (!series.images.front().segmentation.empty()) return openDicomSegments(std::move(series), name, options);
  if (options.dataset) failData("{}: --dataset: of DICOM only segmentations hold several by name", name);
  const DicomImage& first = series.images.front();
  const DicomPixels& pixels = first.pixels;
  SourceInfo info{.name = name, .format = "dicom"};
  info.dims = checkedDims(pixels.width, pixels.height, static_cast<std::int64_t>(series.frames.size()), name,
                          "Columns, Rows, frames");
  info.world_from_index = worldFromIndex(series.geometry, options.spacing, name,
                                         "PixelSpacing, ImageOrientationPatient, ImagePositionPatient");
  tellSpacing(options.spacing, dicomSpacingFields(first, series.frames.size(), series.has_place), info);
  std::set<std::size_t> files;
  for (const DicomFrame& frame : series.frames) files.insert(frame.file);
  tellRead(series.frames.size(), "slice", files.size(), info);
  if (series.has_place) info.space = "left-posterior-superior";
  if (series.has_place || first.spacing) info.length_unit = "mm";
  info.notes = series.notes;
  if (!first.modality.empty() && first.modality.size() <= 16) info.facts.emplace_back("modality", first.modality);
  if (pixels.is_inverted) {
    info.notes.emplace_back("MONOCHROME1: values are turned round, so that what is bright is dense");
  }
  SampleFormat format = pixels.format();
  const bool is_scaled = format.channels == 1 && !haveOneScale(series);
  if (is_scaled) format.type = SampleType::f64;
  const DicomFrame& scale = series.frames.front();
  const bool has_map = format.channels == 1 && !is_scaled;
  format.descending = has_map && scale.slope < 0;
  ChannelConverter converter(format, true, options, name);
  converter.describe(info, options);
  if (info.type != VoxelType::rgba8) {
    for (SourceChannel& channel : info.channels) {
      if (has_map) {
        channel.value_offset = scale.intercept + scale.slope * channel.value_offset;
        channel.value_scale *= scale.slope;
      }
      channel.unit = first.unit;
    }
  }
  return std::make_unique<DicomSource>(std::move(series), std::move(info), std::move(converter), is_scaled,
                                       options.memory_bytes);
}

}  // namespace blockwalk
