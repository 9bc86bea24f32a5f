// SPDX-License-Identifier: Apache-2.0
#include "volume/import/zarr/ome_axes.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "volume/error.h"
#include "volume/formats/length_unit.h"
#include "volume/import/header_text.h"

namespace blockwalk {
namespace {

std::vector<double> numbersOf(const ZarrField& field, std::size_t count) {
  std::vector<double> numbers;
  for (const ZarrField& element : field.elements()) numbers.push_back(element.number());
  if (numbers.size() != count) field.fail(fmt::format("must have {} numbers, one an axis", count));
  return numbers;
}

void readRows(const ZarrField& field, std::size_t columns, OmeMap& map) {
  const std::vector<ZarrField> rows = field.elements();
  if (rows.size() != map.rows.size()) field.fail(fmt::format("must have {} rows, one an axis", map.rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::vector<double> numbers = numbersOf(rows[i], columns);
    std::ranges::copy(numbers, map.rows[i].begin());
  }
}

std::string roleOf(const OmeAxis& axis) {
  std::string name = lowerCase(axis.name);
  if (axis.type == "time" || (axis.type.empty() && (name == "t" || name == "time"))) return "t";
  if (axis.type == "channel" || (axis.type.empty() && (name == "c" || name == "channel"))) return "c";
  if (name == "x" || name == "y" || name == "z") return name;
  return axis.type == "space" ? "space" : "other";
}

}  // namespace

OmeMap OmeMap::identity(std::size_t rank) {
  OmeMap map;
  map.rows.assign(rank, std::vector<double>(rank + 1));
  for (std::size_t i = 0; i < rank; ++i) map.rows[i][i] = 1;
  return map;
}

void OmeMap::then(const OmeMap& transform) {
  const std::size_t rank = rows.size();
  std::vector<std::vector<double>> result(rank, std::vector<double>(rank + 1));
  for (std::size_t i = 0; i < rank; ++i) {
    for (std::size_t j = 0; j <= rank; ++j) {
      for (std::size_t k = 0; k < rank; ++k) result[i][j] += transform.rows[i][k] * rows[k][j];
    }
    result[i][rank] += transform.rows[i][rank];
  }
  rows = std::move(result);
  has_offset = has_offset || transform.has_offset;
}

OmeMap readOmeMap(const ZarrField& transform, std::size_t rank) {
  OmeMap map = OmeMap::identity(rank);
  const ZarrField type = transform.get("type");
  const std::string name = type.text();
  if (name == "identity") return map;
  if (name == "scale") {
    const std::vector<double> numbers = numbersOf(transform.get("scale"), rank);
    for (std::size_t i = 0; i < rank; ++i) map.rows[i][i] = numbers[i];
  } else if (name == "translation") {
    const std::vector<double> numbers = numbersOf(transform.get("translation"), rank);
    for (std::size_t i = 0; i < rank; ++i) map.rows[i][rank] = numbers[i];
    map.has_offset = true;
  } else if (name == "rotation") {
    readRows(transform.get("rotation"), rank, map);
  } else if (name == "affine") {
    readRows(transform.get("affine"), rank + 1, map);
    map.has_offset = std::ranges::any_of(map.rows, [](const auto& row) { return row.back() != 0; });
  } else if (name == "sequence") {
    for (const ZarrField& part : transform.get("transformations").elements()) {
      if (part.get("type").text() == "sequence") part.fail("must be no sequence inside a sequence");
      map.then(readOmeMap(part, rank));
    }
  } else {
    type.fail("identity, scale, translation, rotation, affine and sequence can be read");
  }
  return map;
}

std::vector<std::size_t> OmeRoles::others(const std::vector<std::uint64_t>& shape) const {
  std::vector<std::size_t> others;
  for (std::size_t axis = 0; axis < shape.size(); ++axis) {
    const bool is_used =
        part.channel == axis || time == axis || std::ranges::find(part.space, std::optional(axis)) != part.space.end();
    if (!is_used && shape[axis] > 1) others.push_back(axis);
  }
  return others;
}

OmeRoles rolesOf(const std::vector<OmeAxis>& axes, const std::string& file) {
  OmeRoles roles;
  roles.part.index.assign(axes.size(), 0);
  const auto take = [&](std::optional<std::size_t>& role, std::size_t axis, std::string_view name) {
    if (role) failData("{}: axes: '{}' and '{}' are both {}", file, axes[*role].name, axes[axis].name, name);
    role = axis;
  };
  std::vector<std::size_t> nameless;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    const std::string role = roleOf(axes[axis]);
    if (role == "t") take(roles.time, axis, "time");
    if (role == "c") take(roles.part.channel, axis, "channel");
    if (role.size() == 1 && role >= "x") take(roles.part.space[static_cast<std::size_t>(role[0] - 'x')], axis, role);
    if (role == "space") nameless.push_back(axis);
  }
  // Those of space without such a name are what is left of z, y, x.
  for (std::size_t i = 0; i < 3 && !nameless.empty(); ++i) {
    if (roles.part.space[i]) continue;
    roles.part.space[i] = nameless.back();
    nameless.pop_back();
  }
  if (!roles.part.space[0]) failData("{}: axes: none is x", file);
  return roles;
}

OmePlace placeOf(const OmeMap& map, const std::vector<OmeAxis>& axes, const ArrayPart& part, const std::string& file) {
  OmePlace place;
  const LengthUnit unit = lengthUnit(axes[*part.space[0]].unit);
  place.length_unit = unit.name;
  glm::dvec3 offset{0};
  for (int row = 0; row < 3; ++row) {
    const auto world = part.space[static_cast<std::size_t>(row)];
    if (!world) continue;
    const double factor = factorBetween(lengthUnit(axes[*world].unit), unit);
    if (!(factor > 0)) {
      failData("{}: axes: x is in '{}' and '{}' in '{}', which cannot be turned into each other", file,
               axes[*part.space[0]].unit, axes[*world].name, axes[*world].unit);
    }
    for (int column = 0; column < 3; ++column) {
      const auto axis = part.space[static_cast<std::size_t>(column)];
      if (axis) place.geometry.axes[static_cast<std::size_t>(column)][row] = factor * map.rows[*world][*axis];
    }
    offset[row] = factor * map.rows[*world].back();
  }
  const double thickness = glm::length(place.geometry.axes[0]);
  for (int i = 1; i < 3; ++i) {
    if (!part.space[static_cast<std::size_t>(i)]) place.geometry.axes[static_cast<std::size_t>(i)][i] = thickness;
  }
  if (map.has_offset) place.geometry.first_center = offset;
  for (const auto& axis : part.space) {
    if (!axis || axes[*axis].towards.empty()) return place;
  }
  for (const auto& axis : part.space) {
    if (!place.space.empty()) place.space += '-';
    place.space += axes[*axis].towards;
  }
  return place;
}

}  // namespace blockwalk
