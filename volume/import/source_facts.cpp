// SPDX-License-Identifier: Apache-2.0
#include "volume/import/source_facts.h"

#include <fmt/format.h>

#include <string>

namespace blockwalk {
namespace {

std::string counted(std::uint64_t count, std::string_view what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace

void tellSpacing(const std::optional<glm::dvec3>& spacing, std::string_view fields, SourceInfo& info) {
  std::string from = "guessed: 1, the file says none";
  if (!fields.empty()) from = fields;
  if (spacing) from = "--spacing";
  info.facts.emplace_back(kSpacingFromKey, from);
}

void tellRead(std::uint64_t parts, std::string_view part, std::uint64_t files, SourceInfo& info) {
  info.facts.emplace_back(kReadFromKey, fmt::format("{} in {}", counted(parts, part), counted(files, "file")));
}

}  // namespace blockwalk
