// SPDX-License-Identifier: Apache-2.0
#include "clients/cli/source_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

void printLine(std::string_view name, std::string_view text) { fmt::print("  {:<18} {}\n", name, text); }

std::string vectorOf(const glm::dvec3& vector) {
  return fmt::format("{:.7g} {:.7g} {:.7g}", vector.x, vector.y, vector.z);
}

// Empty where it is not known.
std::string factOf(const SourceInfo& info, std::string_view key) {
  const auto found = std::ranges::find(info.facts, key, [](const auto& fact) { return std::string_view(fact.first); });
  return found == info.facts.end() ? "" : found->second;
}

void printPlace(const SourceInfo& info) {
  const glm::dmat4& place = info.world_from_index;
  const glm::dvec3 axes[] = {glm::dvec3(place[0]), glm::dvec3(place[1]), glm::dvec3(place[2])};
  const std::string unit = info.length_unit.empty() ? "" : " " + info.length_unit;
  const std::string from = factOf(info, kSpacingFromKey);
  printLine("spacing", fmt::format("{:.7g} x {:.7g} x {:.7g}{}{}", glm::length(axes[0]), glm::length(axes[1]),
                                   glm::length(axes[2]), unit, from.empty() ? "" : " (" + from + ")"));
  const bool is_aligned = axes[0] == glm::dvec3(axes[0].x, 0, 0) && axes[1] == glm::dvec3(0, axes[1].y, 0) &&
                          axes[2] == glm::dvec3(0, 0, axes[2].z) && axes[0].x > 0 && axes[1].y > 0 && axes[2].z > 0;
  if (!is_aligned) {
    printLine("axes", fmt::format("{}; {}; {}", vectorOf(axes[0]), vectorOf(axes[1]), vectorOf(axes[2])));
  }
  printLine("first corner", vectorOf(glm::dvec3(place[3])));
  if (!info.space.empty()) printLine("space", info.space);
}

void printChannel(const SourceInfo& info, std::size_t i) {
  const SourceChannel& channel = info.channels[i];
  std::string text = channel.name;
  const auto add = [&](const std::string& part) { text += text.empty() ? part : ", " + part; };
  if (channel.is_labels) add(fmt::format("labels ({} named or coloured)", channel.labels.size()));
  if (channel.value_scale != 1 || channel.value_offset != 0) {
    add(fmt::format("data = {} + {} * stored", channel.value_offset, channel.value_scale));
  }
  if (!channel.unit.empty()) add(fmt::format("unit {}", channel.unit));
  if (channel.color) {
    add(fmt::format("colour {:02x}{:02x}{:02x}", (*channel.color)[0], (*channel.color)[1], (*channel.color)[2]));
  }
  if (channel.window) add(fmt::format("window {:.7g} to {:.7g}", (*channel.window)[0], (*channel.window)[1]));
  if (!text.empty()) printLine(info.channels.size() > 1 ? fmt::format("channel {}", i) : "values", text);
}

}  // namespace

void printSource(const SourceInfo& info) {
  printLine("format", info.format);
  printPlace(info);
  for (std::size_t i = 0; i < info.channels.size(); ++i) printChannel(info, i);
  for (const auto& [key, value] : info.facts) {
    if (key == kReadFromKey) printLine("read from", value);
    if (key != kReadFromKey && key != kSpacingFromKey) printLine(key, value);
  }
}

}  // namespace blockwalk
