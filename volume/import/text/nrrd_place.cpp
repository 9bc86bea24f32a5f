// SPDX-License-Identifier: Apache-2.0
#include "volume/import/text/nrrd_place.h"

#include <string>
#include <string_view>
#include <vector>

#include "volume/error.h"
#include "volume/import/header_text.h"

namespace blockwalk {
namespace {

class NrrdPlace {
 public:
  NrrdPlace(const NrrdFields& fields, std::span<const std::int64_t> sizes, std::span<const std::size_t> axes)
      : fields_(fields), sizes_(sizes), axes_(axes) {}

  Geometry read();

 private:
  std::vector<std::optional<double>> perAxis(const std::string& name, const std::string& text) const {
    auto numbers = fields_.numbers(name, text);
    if (numbers.size() != sizes_.size()) {
      failData("{}: {}: {} are given, dimension is {}", fields_.name(), name, numbers.size(), sizes_.size());
    }
    return numbers;
  }
  std::vector<std::optional<glm::dvec3>> axisSteps();
  void readExtents(std::vector<std::optional<glm::dvec3>>& steps);
  void readOrigin();

  const NrrdFields& fields_;
  std::span<const std::int64_t> sizes_;
  std::span<const std::size_t> axes_;
  Geometry geometry_;
};

// The step along each of the file's axes, as far as `space directions`, `spacings` or the ends of axes give one.
std::vector<std::optional<glm::dvec3>> NrrdPlace::axisSteps() {
  if (const std::string* directions = fields_.find("space directions")) {
    auto steps = fields_.vectors("space directions", *directions);
    if (steps.size() != sizes_.size()) {
      failData("{}: space directions: {} are given, dimension is {}", fields_.name(), steps.size(), sizes_.size());
    }
    return steps;
  }
  std::vector<std::optional<glm::dvec3>> steps(sizes_.size());
  readExtents(steps);
  const std::string* spacings = fields_.find("spacings");
  if (spacings == nullptr) return steps;
  const auto lengths = perAxis("spacings", *spacings);
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (!lengths[axes_[i]]) continue;
    glm::dvec3 step{0};
    step[static_cast<int>(i)] = *lengths[axes_[i]];
    steps[axes_[i]] = step;
  }
  return steps;
}

// Where an axis begins and ends: at the borders of its samples when they are cells, else at their centres.
void NrrdPlace::readExtents(std::vector<std::optional<glm::dvec3>>& steps) {
  const std::string* least = fields_.find("axis mins");
  const std::string* most = fields_.find("axis maxs");
  if (least == nullptr || most == nullptr || fields_.find("space origin") != nullptr) return;
  const auto begins = perAxis("axis mins", *least);
  const auto ends = perAxis("axis maxs", *most);
  const std::string* centerings = fields_.find("centerings");
  const auto kinds = words(centerings != nullptr ? std::string_view(*centerings) : std::string_view());
  glm::dvec3 first{0};
  bool all = true;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const std::size_t axis = axes_[i];
    const bool is_cell = axis < kinds.size() && lowerCase(kinds[axis]) == "cell";
    const double steps_between = static_cast<double>(sizes_[axis] - (is_cell ? 0 : 1));
    const bool known = begins[axis] && ends[axis] && steps_between > 0 && *ends[axis] != *begins[axis];
    if (!known) {
      all = false;
      continue;
    }
    const auto place = static_cast<int>(i);
    glm::dvec3 step{0};
    step[place] = (*ends[axis] - *begins[axis]) / steps_between;
    first[place] = *begins[axis] + (is_cell ? step[place] / 2 : 0);
    steps[axis] = step;
  }
  if (all && fields_.find("spacings") == nullptr) geometry_.first_center = first;
}

Geometry NrrdPlace::read() {
  const auto steps = axisSteps();
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (steps[axes_[i]]) geometry_.axes[i] = *steps[axes_[i]];
  }
  // One slice that lies obliquely: the axis that the file does not have stands upright on the two that it has.
  const glm::dvec3 normal = glm::cross(geometry_.axes[0], geometry_.axes[1]);
  if (axes_.size() == 2 && glm::length(normal) > 0) geometry_.axes[2] = glm::normalize(normal);
  readOrigin();
  return geometry_;
}

void NrrdPlace::readOrigin() {
  const std::string* origin = fields_.find("space origin");
  if (origin == nullptr) return;
  const auto points = fields_.vectors("space origin", *origin);
  if (points.size() != 1) failData("{}: space origin: '{}' is not one point", fields_.name(), *origin);
  geometry_.first_center = points[0];
}

}  // namespace

Geometry readNrrdPlace(const NrrdFields& fields, std::span<const std::int64_t> sizes,
                       std::span<const std::size_t> axes) {
  return NrrdPlace(fields, sizes, axes).read();
}

std::string nrrdSpacingFields(const NrrdFields& fields) {
  if (fields.find("space directions") != nullptr) return "space directions";
  const bool has_extents = fields.find("axis mins") != nullptr && fields.find("axis maxs") != nullptr &&
                           fields.find("space origin") == nullptr;
  if (fields.find("spacings") != nullptr) return has_extents ? "spacings, axis mins, axis maxs" : "spacings";
  return has_extents ? "axis mins, axis maxs" : "";
}

}  // namespace blockwalk
