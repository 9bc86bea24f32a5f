// SPDX-License-Identifier: Apache-2.0
// What is asked of POST .../animate: an animation, and as what it comes.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "protocol/animation.h"
#include "protocol/query_member.h"

namespace blockwalk {

enum class AnimationFormat : std::uint8_t { zip, webp };

// Frames times pixels. A zip of so many has less than 4 GiB, whatever they show; a WebP is put together in memory.
constexpr std::int64_t kMostZipPixels = 1'000'000'000;
constexpr std::int64_t kMostWebpPixels = 100'000'000;
// Frames times pixels times samples.
constexpr std::int64_t kMostAnimationRays = 16'000'000'000;

struct AnimationRequest {
  Animation animation;
  AnimationFormat format = AnimationFormat::zip;
  int quality = 85;  // 1..100, webp
};

inline constexpr std::array kAnimationMembers = {
    QueryMember{"fps", "0.1..120", "frames a second (25)"},
    QueryMember{"frames", "1..3600", "how many frames there are, in place of fps"},
    QueryMember{"size", "[W, H]", "of all views, of which then none has one"},
    QueryMember{"view", "{...}", "the view that a turntable turns (the volume's own)"},
    QueryMember{"turntable", "{axis, degrees, seconds}", "a turn of the view about an axis through its target"},
    QueryMember{"keys", "[{seconds, view}, ...]", "1..256 views in time, in place of view and turntable"},
    QueryMember{"format", "zip|webp", "PNG pictures in a zip file, or one animated WebP (zip)"},
    QueryMember{"quality", "1..100", "of WebP; 100 is lossless (85)"}};

// Members as readAnimation() has them, "format" and "quality". Throws ViewError naming the member and the bound.
AnimationRequest readAnimationRequest(const nlohmann::json& object);

// Throws ProblemError, 413, where there is more than a server makes at once.
void checkAnimationSize(const Film& film, AnimationFormat format);

std::string_view animationMimeType(AnimationFormat format);

}  // namespace blockwalk
