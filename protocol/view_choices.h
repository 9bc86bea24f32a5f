// SPDX-License-Identifier: Apache-2.0
// Names of a view's choices, in the order in which messages list them.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "protocol/view_fields.h"
#include "protocol/view_values.h"

namespace blockwalk {

template <typename Value>
struct Choice {
  std::string_view name;
  Value value;
};
template <typename Value>
Choice(std::string_view, Value) -> Choice<Value>;

inline constexpr std::array kModeChoices = {Choice{"blend", Mode::blend},
                                            Choice{"first-hit", Mode::first_hit},
                                            Choice{"mip", Mode::mip},
                                            Choice{"minip", Mode::minip},
                                            Choice{"attenuated-mip", Mode::attenuated_mip},
                                            Choice{"mean", Mode::mean},
                                            Choice{"iso", Mode::iso},
                                            Choice{"blocks", Mode::blocks}};
inline constexpr std::array kFilterChoices = {Choice{"nearest", Filter::nearest}, Choice{"linear", Filter::linear}};
inline constexpr std::array kClassificationChoices = {Choice{"post", Classification::post},
                                                      Choice{"pre-integrated", Classification::pre_integrated}};
inline constexpr std::array kRequestsChoices = {Choice{"file", Requests::file}, Choice{"shells", Requests::shells},
                                                Choice{"transmittance", Requests::transmittance}};
inline constexpr std::array kStandInChoices = {Choice{"auto", StandIn::automatic}, Choice{"mean", StandIn::mean},
                                               Choice{"maximum", StandIn::maximum}};
inline constexpr std::array kTransferShapeChoices = {Choice{"linear", TransferShape::linear},
                                                     Choice{"stepped", TransferShape::stepped}};
inline constexpr std::array kTransferPresetChoices = {Choice{"auto", TransferPreset::automatic},
                                                      Choice{"grey", TransferPreset::grey},
                                                      Choice{"viridis", TransferPreset::viridis},
                                                      Choice{"cividis", TransferPreset::cividis},
                                                      Choice{"inferno", TransferPreset::inferno},
                                                      Choice{"ct-bone", TransferPreset::ct_bone},
                                                      Choice{"ct-soft-tissue", TransferPreset::ct_soft_tissue},
                                                      Choice{"angiography", TransferPreset::angiography}};
inline constexpr std::array kFinderChoices = {
    Choice{"auto", Finder::automatic},    Choice{"query", Finder::query},       Choice{"grid", Finder::grid},
    Choice{"clusters", Finder::clusters}, Choice{"boundary", Finder::boundary}, Choice{"octree", Finder::octree},
    Choice{"none", Finder::none}};
inline constexpr std::array kMacrocellChoices = {Choice{"auto", kAutoMacrocell}, Choice{"8", 8}, Choice{"16", 16},
                                                 Choice{"32", 32}};
inline constexpr std::array kOutputChoices = {Choice{"color", Output::color},       Choice{"depth", Output::depth},
                                              Choice{"position", Output::position}, Choice{"cost", Output::cost},
                                              Choice{"queries", Output::queries},   Choice{"mesh", Output::mesh},
                                              Choice{"value", Output::value}};
inline constexpr std::array kFormatChoices = {Choice{"png", ImageFormat::png}, Choice{"jpeg", ImageFormat::jpeg},
                                              Choice{"webp", ImageFormat::webp}, Choice{"raw", ImageFormat::raw}};

// "a, b and c"
template <typename Value, std::size_t Size>
std::string choiceNames(const std::array<Choice<Value>, Size>& choices) {
  std::string names;
  for (std::size_t i = 0; i < Size; ++i) {
    if (i > 0) names += i + 1 < Size ? ", " : " and ";
    names += choices[i].name;
  }
  return names;
}

// A choice that a later version knows gets the same message as one nobody knows: what is supported.
template <typename Value, std::size_t Size>
Value parseChoice(std::string_view field, std::string_view text, const std::array<Choice<Value>, Size>& choices) {
  for (const auto& choice : choices) {
    if (choice.name == text) return choice.value;
  }
  failValue(field, "this version supports " + choiceNames(choices), text);
}

template <typename Value, std::size_t Size>
std::string_view choiceName(Value value, const std::array<Choice<Value>, Size>& choices) {
  for (const auto& choice : choices) {
    if (choice.value == value) return choice.name;
  }
  return {};
}

}  // namespace blockwalk
