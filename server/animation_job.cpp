// SPDX-License-Identifier: Apache-2.0
#include "server/animation_job.h"

#include <nlohmann/json.hpp>

#include "protocol/json_text.h"

namespace blockwalk {

AnimationJob readAnimationJob(const Asked& asked) {
  const CatalogEntry& entry = asked.volume();
  nlohmann::json body = parseJson(jsonBody(asked.request));
  const JsonEnd end(body);
  const AnimationRequest wanted = readAnimationRequest(body);
  const ServedVolume& volume = requireReady(entry, asked.state);
  auto film = std::make_shared<const Film>(wanted.animation, *volume.info);
  checkAnimationSize(*film, wanted.format);
  const std::string_view type = animationMimeType(wanted.format);
  if (!acceptsType(asked.request, type)) refuse(406, fmt::format("this animation is {}", type), "Accept");
  if (asked.request.version == 10 && wanted.format == AnimationFormat::zip) {
    refuse(505, "a zip comes in chunks, which HTTP/1.1 has", "version");
  }
  return {.volume = entry.served, .film = std::move(film), .format = wanted.format, .quality = wanted.quality};
}

}  // namespace blockwalk
