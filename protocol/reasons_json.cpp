// SPDX-License-Identifier: Apache-2.0
#include "protocol/reasons_json.h"

#include <nlohmann/json.hpp>
#include <utility>

namespace blockwalk {

nlohmann::json reasonsJson(std::span<const Reason> reasons) {
  nlohmann::json list = nlohmann::json::array();
  for (const Reason& reason : reasons) {
    nlohmann::json change = nlohmann::json::object();
    for (const ViewChange& member : reason.change) {
      std::visit([&](const auto& value) { change[member.member] = value; }, member.value);
    }
    list.push_back({{"reason", reason.name}, {"detail", reason.detail}, {"change", std::move(change)}});
  }
  return list;
}

std::vector<Reason> readReasons(const nlohmann::json& reasons) {
  std::vector<Reason> list;
  for (const nlohmann::json& item : reasons) {
    Reason reason{
        .name = item.at("reason").get<std::string>(), .detail = item.at("detail").get<std::string>(), .change = {}};
    for (const auto& [member, value] : item.at("change").items()) {
      ViewChange change{.member = member, .value = 0.0};
      if (value.is_number()) {
        change.value = value.get<double>();
      } else {
        change.value = value.get<std::string>();
      }
      reason.change.push_back(std::move(change));
    }
    list.push_back(std::move(reason));
  }
  return list;
}

}  // namespace blockwalk
