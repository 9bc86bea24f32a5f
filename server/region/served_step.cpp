// SPDX-License-Identifier: Apache-2.0
#include "server/region/served_step.h"

#include <fmt/format.h>

#include <utility>

#include "protocol/problem.h"
#include "server/base/file_look.h"

namespace blockwalk {

void requireIdentity(const ServedFile& served) {
  const FileLook look = lookAt(served.file);
  if (look.identity == served.identity) return;
  const std::string why = look.missing.empty() ? "was replaced" : look.is_gone ? "is gone" : "cannot be looked at";
  throw ProblemError({.status = 503, .detail = fmt::format("{}: the file {}", served.id, why), .field = {}});
}

VolumeFile openStep(const std::filesystem::path& file, int step) {
  VolumeFile opened(file);
  return step > 0 && step < opened.info().steps ? opened.atStep(step) : std::move(opened);
}

}  // namespace blockwalk
