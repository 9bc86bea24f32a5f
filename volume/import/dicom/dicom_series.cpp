// SPDX-License-Identifier: Apache-2.0
#include "volume/import/dicom/dicom_series.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "volume/error.h"
#include "volume/import/dicom/dicom_frames.h"
#include "volume/import/frame.h"
#include "volume/import/header_text.h"

namespace blockwalk {
namespace {

constexpr double kSame = 1e-3;  // millimetres, and of unit vectors

bool areAlike(const DicomImage& a, const DicomImage& b) {
  if (a.pixels != b.pixels || a.segmentation != b.segmentation || a.directions.has_value() != b.directions.has_value())
    return false;
  if (!a.directions) return true;
  return glm::length((*a.directions)[0] - (*b.directions)[0]) < kSame &&
         glm::length((*a.directions)[1] - (*b.directions)[1]) < kSame;
}

using SeriesByUid = std::map<std::string, std::vector<DicomImage>>;

std::vector<DicomImage> chooseSeries(SeriesByUid& all, const std::string& name, const ImportOptions& options) {
  if (all.size() == 1 && !options.series) return std::move(all.begin()->second);
  std::string list;
  std::size_t number = 0;
  for (auto& [uid, images] : all) {
    ++number;
    const bool is_it = options.series && (*options.series == uid || *options.series == fmt::format("{}", number));
    if (is_it) return std::move(images);
    const DicomPixels& pixels = images[0].pixels;
    list += fmt::format("\n  --series {}: {} of {} x {}, {} files, {}", number,
                        images[0].modality.empty() ? "images" : images[0].modality, pixels.width, pixels.height,
                        images.size(), uid);
  }
  if (options.series) failData("{}: --series {}: there is no such series; there are{}", name, *options.series, list);
  failData("{}: holds {} series; choose one:{}", name, all.size(), list);
}

class SeriesOrder {
 public:
  SeriesOrder(DicomSeries& series, const std::string& name, const ImportOptions& options)
      : series_(series), name_(name), options_(options) {}

  void sort() {
    const DicomImage& first = series_.images.front();
    for (std::size_t i = 0; i < series_.images.size(); ++i) {
      for (DicomFrame frame : series_.images[i].frames) {
        frame.file = i;
        series_.frames.push_back(frame);
      }
    }
    const bool all_placed =
        std::ranges::all_of(series_.frames, [](const DicomFrame& frame) { return frame.has_position; });
    series_.has_place = first.directions.has_value() && all_placed;
    if (!series_.has_place) return sortByNumber();
    normal_ = glm::cross((*first.directions)[0], (*first.directions)[1]);
    std::ranges::stable_sort(series_.frames, {}, &DicomFrame::number);
    std::ranges::stable_sort(series_.frames, {}, [&](const DicomFrame& frame) { return along(frame); });
    takeOneOfEach();
    placeFrames();
  }

 private:
  double along(const DicomFrame& frame) const { return glm::dot(frame.position, normal_); }

  void sortByNumber() {
    std::ranges::stable_sort(series_.frames, {}, &DicomFrame::number);
    const DicomImage& first = series_.images.front();
    const glm::dvec2 size = first.spacing.value_or(glm::dvec2(1));
    series_.geometry.axes = {glm::dvec3(size.x, 0, 0), glm::dvec3(0, size.y, 0),
                             glm::dvec3(0, 0, first.thickness > 0 ? first.thickness : size.x)};
    if (series_.frames.size() > 1) {
      series_.notes.emplace_back("the images do not say where they lie: they are in the order of their numbers");
    }
  }

  // Several frames at each place are as many volumes; some at some are told.
  void takeOneOfEach() {
    std::vector<std::vector<DicomFrame>> places;
    for (const DicomFrame& frame : series_.frames) {
      const bool same = !places.empty() && std::fabs(along(frame) - along(places.back()[0])) < kSame;
      if (!same) places.emplace_back();
      places.back().push_back(frame);
    }
    const std::size_t count = places[0].size();
    const bool is_regular = std::ranges::all_of(places, [&](const auto& place) { return place.size() == count; });
    std::size_t chosen = 0;
    if (is_regular && places.size() > 1) {
      chosen = chosenFrame(options_, static_cast<std::int64_t>(count), name_, "ImagePositionPatient", series_.notes);
    }
    const std::size_t all = series_.frames.size();
    series_.frames.clear();
    for (const auto& place : places) series_.frames.push_back(place[std::min(chosen, place.size() - 1)]);
    if (!is_regular) {
      series_.notes.push_back(
          fmt::format("{} images lie where another one does, and are passed over", all - series_.frames.size()));
    }
  }

  void placeFrames() {
    const DicomImage& first = series_.images.front();
    const glm::dvec2 size = first.spacing.value_or(glm::dvec2(1));
    if (!first.spacing) series_.notes.emplace_back("PixelSpacing is not said: it is taken to be 1 mm");
    if (first.is_thickness_guessed) {
      series_.notes.emplace_back("SpacingBetweenSlices is not said: frames are taken to be as far apart as pixels");
    }
    const auto& [row, column] = *first.directions;
    const auto& frames = series_.frames;
    glm::dvec3 step = normal_ * (first.thickness > 0 ? first.thickness : size.x);
    if (frames.size() > 1) {
      std::vector<double> apart;
      for (std::size_t i = 1; i < frames.size(); ++i) apart.push_back(along(frames[i]) - along(frames[i - 1]));
      std::vector<double> sorted = apart;
      std::ranges::sort(sorted);
      const double usual = sorted[sorted.size() / 2];
      step = stepBetween(apart, usual);
      tellGaps(apart, usual);
    }
    series_.geometry.axes = {row * size.x, column * size.y, step};
    series_.geometry.first_center = frames.front().position;
  }

  // From slice to slice, which a gantry may have tilted away from the normal: the mean of those that are as usual.
  glm::dvec3 stepBetween(const std::vector<double>& apart, double usual) const {
    glm::dvec3 sum{0};
    double count = 0;
    for (std::size_t i = 0; i < apart.size(); ++i) {
      if (std::fabs(apart[i] - usual) > 0.02 * usual) continue;
      sum += series_.frames[i + 1].position - series_.frames[i].position;
      count += 1;
    }
    return sum / count;
  }

  void tellGaps(const std::vector<double>& apart, double usual) {
    std::size_t missing = 0;
    std::size_t irregular = 0;
    std::string where;
    for (std::size_t i = 0; i < apart.size(); ++i) {
      if (std::fabs(apart[i] - usual) <= 0.02 * usual) continue;
      const double steps = apart[i] / usual;
      const bool is_gap = steps > 1.5 && std::fabs(steps - std::round(steps)) < 0.1;
      if (is_gap) missing += static_cast<std::size_t>(std::min(std::round(steps) - 1, 1e6));
      if (!is_gap) ++irregular;
      if (where.size() < 80) where += fmt::format("{}{}", where.empty() ? "" : ", ", i + 1);
    }
    if (missing > 0) {
      series_.notes.push_back(
          fmt::format("{} slices are missing, behind slice {} of {}: those that are there lie one "
                      "after the other, {:.6g} mm apart",
                      missing, where, series_.frames.size(), usual));
    }
    if (irregular > 0) {
      series_.notes.push_back(
          fmt::format("{} slices are not as far apart as the others, behind slice {} of {}: all are "
                      "taken to be {:.6g} mm apart",
                      irregular, where, series_.frames.size(), usual));
    }
  }

  DicomSeries& series_;
  const std::string& name_;
  const ImportOptions& options_;
  glm::dvec3 normal_{0};
};

// The greatest group of images that are alike; a scout or a report beside them is told.
void keepAlike(DicomSeries& series) {
  std::vector<std::vector<DicomImage>> groups;
  for (DicomImage& image : series.images) {
    const auto group = std::ranges::find_if(groups, [&](const auto& known) { return areAlike(known[0], image); });
    if (group == groups.end()) {
      groups.emplace_back().push_back(std::move(image));
    } else {
      group->push_back(std::move(image));
    }
  }
  const auto most = std::ranges::max_element(groups, {}, [](const auto& group) { return group.size(); });
  const std::size_t all = series.images.size();
  series.images = std::move(*most);
  if (series.images.size() < all) {
    series.notes.push_back(
        fmt::format("{} images of another size, kind or direction are passed over", all - series.images.size()));
  }
}

}  // namespace

std::string dicomSpacingFields(const DicomImage& image, std::size_t slices, bool by_position) {
  std::string fields = image.spacing ? "PixelSpacing" : "of pixels guessed: 1";
  if (slices < 2) return image.spacing ? fields : "";
  if (by_position && !image.is_thickness_guessed) {
    return fields + ", " + (image.step_field.empty() ? "ImagePositionPatient" : image.step_field);
  }
  if (image.is_step_said) return fields + ", SpacingBetweenSlices";
  if (image.thickness > 0 && !image.is_thickness_guessed) return fields + ", SliceThickness";
  return image.spacing ? fields + ", between slices guessed: as along a row" : "";
}

DicomSeries openDicomSeries(const std::vector<std::filesystem::path>& paths, const std::string& name,
                            const ImportOptions& options) {
  SeriesByUid all;
  for (const auto& path : paths) {
    auto image = readDicomImage(path);
    if (!image) continue;
    std::vector<DicomImage>& known = all[image->series];
    // Large tables, and mostly one of all.
    if (image->palette && !known.empty() && known.back().palette && *image->palette == *known.back().palette) {
      image->palette = known.back().palette;
    }
    known.push_back(std::move(*image));
  }
  if (all.empty()) failData("{}: PixelData: no file of it has any", name);
  DicomSeries series;
  series.images = chooseSeries(all, name, options);
  keepAlike(series);
  for (const DicomImage& image : series.images) {
    if (canReadDicom(image.transfer_syntax)) continue;
    failData("{}: TransferSyntaxUID: {} cannot be read{}", image.name, image.transfer_syntax,
             canUnpackDicom("1.2.840.10008.1.2.4.70") ? "" : "; this program was built without GDCM, which reads JPEG");
  }
  if (series.images.front().segmentation.empty()) SeriesOrder(series, name, options).sort();
  return series;
}

}  // namespace blockwalk
