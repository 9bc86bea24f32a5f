// SPDX-License-Identifier: Apache-2.0
#include "volume/import/hdf5/hdf5_scales.h"

#include <cmath>

#include "volume/formats/length_unit.h"

namespace blockwalk {
namespace {

// Of places: the step that all of them keep to, within a hundredth of it.
std::optional<double> commonStep(const std::vector<double>& places) {
  if (places.size() < 2) return std::nullopt;
  const double step = (places.back() - places.front()) / static_cast<double>(places.size() - 1);
  if (!std::isfinite(step) || step == 0) return std::nullopt;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double wanted = places.front() + step * static_cast<double>(i);
    if (!(std::fabs(places[i] - wanted) <= 0.01 * std::fabs(step))) return std::nullopt;
  }
  return step;
}

}  // namespace

std::optional<AxisScale> readScale(Hdf5File& file, const std::string& path, std::uint64_t count,
                                   std::vector<std::string>& notes) {
  const auto object = file.object(path);
  if (!object || !object->array) {
    notes.push_back(fmt::format("the places of an axis, '{}', are not there", path));
    return std::nullopt;
  }
  AxisScale scale;
  if (const auto unit = object->text("units")) scale.unit = *unit;
  const Hdf5Array& array = *object->array;
  const bool has_edges = array.rank() == 1 && array.shape[0] == count + 1;
  if (!array.format || array.rank() != 1 || (array.shape[0] != count && !has_edges)) {
    notes.push_back(fmt::format("the places of an axis, '{}', are {}, which is not one for each of {} samples", path,
                                array.described(), count));
    return std::nullopt;
  }
  if (count == 1 && !has_edges) return std::nullopt;
  const std::vector<double> places = file.numbers(path);
  const auto step = commonStep(places);
  if (!step) {
    notes.push_back(fmt::format("the places of an axis, '{}', are not one step apart: they are not kept", path));
    return std::nullopt;
  }
  scale.step = *step;
  scale.first = places.front() + (has_edges ? 0.5 * *step : 0);
  return scale;
}

void placeByScales(const std::array<std::optional<AxisScale>, 3>& scales, const ArrayPart& part,
                   const std::string& fields, Hdf5Image& image) {
  const AxisScale* reference = nullptr;
  for (const auto& scale : scales) {
    if (scale && (reference == nullptr || (reference->unit.empty() && !scale->unit.empty()))) reference = &*scale;
  }
  if (reference == nullptr) return;
  const LengthUnit unit = lengthUnit(reference->unit);
  std::array<double, 3> steps{0, 0, 0};
  glm::dvec3 first{0};
  double sum = 0;
  int known = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!scales[i]) continue;
    const double factor = scales[i]->unit.empty() ? 1 : factorBetween(lengthUnit(scales[i]->unit), unit);
    if (!(factor > 0)) {
      image.notes.push_back(
          fmt::format("axes are in '{}' and '{}', which cannot be turned into each other: steps are 1", reference->unit,
                      scales[i]->unit));
      return;
    }
    steps[i] = factor * scales[i]->step;
    first[static_cast<int>(i)] = factor * scales[i]->first;
    sum += std::fabs(steps[i]);
    ++known;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (scales[i]) continue;
    steps[i] = sum / known;
    if (part.space[i]) {
      image.notes.push_back(
          fmt::format("the step along {} is not said: it is taken to be {}, the mean of others", "xyz"[i], steps[i]));
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    image.geometry.axes[i] = glm::dvec3(0);
    image.geometry.axes[i][static_cast<int>(i)] = steps[i];
  }
  image.geometry.first_center = first;
  image.length_unit = unit.name;
  image.spacing_fields = fields;
}

}  // namespace blockwalk
