// SPDX-License-Identifier: Apache-2.0
#include "protocol/pick_request.h"

#include <nlohmann/json.hpp>

#include "protocol/view_values.h"

namespace blockwalk {

PickRequest readPickRequest(const std::vector<std::pair<std::string, std::string>>& members) {
  std::optional<std::string> x;
  std::optional<std::string> y;
  std::vector<std::pair<std::string, std::string>> others;
  for (const auto& [name, text] : members) {
    std::optional<std::string>* place = name == "x" ? &x : name == "y" ? &y : nullptr;
    if (place == nullptr) {
      others.emplace_back(name, text);
    } else {
      if (*place) failName(name, "is given twice");
      *place = text;
    }
  }
  ImageRequest image;
  setViewFields(image, others);
  const auto pixel = [](std::string_view name, const std::optional<std::string>& text, int size) {
    if (!text) failName(name, fmt::format("is missing: a whole number from 0 to {}", size - 1));
    return parseInteger(name, *text, 0, size - 1);
  };
  PickRequest request{.view = image.view, .pixel = {pixel("x", x, image.view.width), pixel("y", y, image.view.height)}};
  request.view.output = Output::position;
  request.view.samples = 1;
  return request;
}

nlohmann::json pickJson(const std::optional<ShownPoint>& shown, const std::vector<std::optional<double>>& values) {
  if (!shown) return {{"hit", false}};
  nlohmann::json list = nlohmann::json::array();
  for (const std::optional<double>& value : values) list.push_back(value ? nlohmann::json(*value) : nlohmann::json());
  return {{"hit", true},
          {"voxel", {shown->voxel.x, shown->voxel.y, shown->voxel.z}},
          {"world", {shown->world.x, shown->world.y, shown->world.z}},
          {"t", shown->t},
          {"level", shown->level},
          {"values", std::move(list)}};
}

}  // namespace blockwalk
