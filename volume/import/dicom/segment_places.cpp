// SPDX-License-Identifier: Apache-2.0
#include "volume/import/dicom/segment_places.h"

#include <algorithm>
#include <cmath>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr double kSamePlace = 1e-3;  // millimetres

class SegmentPlacer {
 public:
  SegmentPlacer(const DicomImage& image, const std::string& name, std::vector<std::string>& notes)
      : image_(image), name_(name), notes_(notes), frames_(image.frames) {}

  SegmentPlaces place() {
    const bool all_placed = std::ranges::all_of(frames_, [](const DicomFrame& frame) { return frame.has_position; });
    result_.has_place = image_.directions.has_value() && all_placed;
    if (!image_.spacing) notes_.emplace_back("PixelSpacing is not said: it is taken to be 1 mm");
    if (!result_.has_place) {
      placeByNumber();
    } else {
      const auto& [row, column] = *image_.directions;
      normal_ = glm::cross(row, column);
      std::ranges::stable_sort(frames_, {}, [&](const DicomFrame& frame) { return along(frame); });
      placeByPosition(row, column);
    }
    for (auto& slice : result_.slices) std::ranges::stable_sort(slice, {}, &DicomFrame::segment);
    return std::move(result_);
  }

 private:
  double along(const DicomFrame& frame) const { return glm::dot(frame.position, normal_); }
  glm::dvec2 size() const { return image_.spacing.value_or(glm::dvec2(1)); }
  double thickness() const { return image_.thickness > 0 ? image_.thickness : size().x; }

  void placeByNumber() {
    const bool are_one =
        std::ranges::all_of(frames_, [&](const DicomFrame& frame) { return frame.segment == frames_.front().segment; });
    if (!are_one) failData("{}: ImagePositionPatient: frames of several segments do not say where they lie", name_);
    for (const DicomFrame& frame : frames_) result_.slices.push_back({frame});
    result_.geometry.axes = {glm::dvec3(size().x, 0, 0), glm::dvec3(0, size().y, 0), glm::dvec3(0, 0, thickness())};
    if (frames_.size() > 1) {
      notes_.emplace_back("the frames do not say where they lie: they are in the order of their numbers");
    }
  }

  // The distance of slices: what the file says, where the nearest two are so many apart.
  double stepOf() const {
    double nearest = HUGE_VAL;
    for (std::size_t i = 1; i < frames_.size(); ++i) {
      const double apart = along(frames_[i]) - along(frames_[i - 1]);
      if (apart >= kSamePlace) nearest = std::min(nearest, apart);
    }
    if (!std::isfinite(nearest)) return thickness();
    const double times = nearest / thickness();
    return image_.is_step_said && times > 0.5 && std::fabs(times - std::round(times)) < 0.1 ? thickness() : nearest;
  }

  void placeByPosition(const glm::dvec3& row, const glm::dvec3& column) {
    const double step = stepOf();
    std::size_t irregular = 0;
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const double steps = i == 0 ? 0 : (along(frames_[i]) - along(frames_[i - 1])) / step;
      const bool is_same = steps * step < kSamePlace;
      // As many slices further as there are steps, so that what positions round does not add up.
      const double further = i == 0 ? 1 : is_same ? 0 : std::max(1.0, std::round(steps));
      if (further + static_cast<double>(result_.slices.size()) > kMaxDim) {
        failData(
            "{}: ImagePositionPatient: frames are {:.6g} mm apart or more, from the first to the last more than {} "
            "slices",
            name_, step, kMaxDim);
      }
      if (!is_same && std::fabs(steps - std::round(steps)) > 0.1) ++irregular;
      result_.slices.resize(result_.slices.size() + static_cast<std::size_t>(further));
      result_.slices.back().push_back(frames_[i]);
    }
    if (irregular > 0) {
      notes_.push_back(
          fmt::format("{} of {} frames do not lie whole slices behind the one before: slices are taken to "
                      "be {:.6g} mm apart",
                      irregular, frames_.size(), step));
    }
    const auto steps = static_cast<double>(result_.slices.size() - 1);
    const glm::dvec3 whole = frames_.back().position - frames_.front().position;
    result_.geometry.axes = {row * size().x, column * size().y, steps > 0 ? whole / steps : normal_ * step};
    result_.geometry.first_center = frames_.front().position;
  }

  const DicomImage& image_;
  const std::string& name_;
  std::vector<std::string>& notes_;
  std::vector<DicomFrame> frames_;
  glm::dvec3 normal_{0};
  SegmentPlaces result_;
};

}  // namespace

SegmentPlaces placeSegments(const DicomImage& image, const std::string& name, std::vector<std::string>& notes) {
  return SegmentPlacer(image, name, notes).place();
}

}  // namespace blockwalk
