// SPDX-License-Identifier: Apache-2.0
#include "protocol/animation_request.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "protocol/problem.h"
#include "protocol/view_values.h"

namespace blockwalk {
namespace {

AnimationFormat formatIn(const nlohmann::json& value) {
  if (value == "zip") return AnimationFormat::zip;
  if (value == "webp") return AnimationFormat::webp;
  failName("format", "must be zip or webp");
}

[[noreturn]] void refuseSize(const char* field, std::string detail) {
  throw ProblemError({.status = 413, .detail = std::move(detail), .field = field});
}

}  // namespace

AnimationRequest readAnimationRequest(const nlohmann::json& object) {
  AnimationRequest request;
  constexpr std::array<std::string_view, 2> kOwn = {"format", "quality"};
  request.animation = readAnimation(object, kOwn);
  if (object.contains("format")) request.format = formatIn(object["format"]);
  if (const auto quality = object.find("quality"); quality != object.end()) {
    if (request.format != AnimationFormat::webp) failName("quality", "is of webp: PNG is lossless");
    request.quality = parseInteger("quality", quality->is_number() ? quality->dump() : "", 1, 100);
  }
  return request;
}

void checkAnimationSize(const Film& film, AnimationFormat format) {
  const View view = film.view(0);
  const std::int64_t pixels = std::int64_t{film.frames()} * view.width * view.height;
  const std::int64_t most = format == AnimationFormat::zip ? kMostZipPixels : kMostWebpPixels;
  if (pixels > most) {
    refuseSize("frames",
               fmt::format("{} frames of {}x{} are {} pixels, of which {} may have at most {}", film.frames(),
                           view.width, view.height, pixels, format == AnimationFormat::zip ? "a zip" : "a webp", most));
  }
  if (pixels * film.samples() > kMostAnimationRays) {
    refuseSize("samples", fmt::format("{} pixels of {} samples are {} rays, of which an animation has at most {}",
                                      pixels, film.samples(), pixels * film.samples(), kMostAnimationRays));
  }
}

std::string_view animationMimeType(AnimationFormat format) {
  return format == AnimationFormat::zip ? "application/zip" : "image/webp";
}

}  // namespace blockwalk
