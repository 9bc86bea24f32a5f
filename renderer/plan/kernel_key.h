// SPDX-License-Identifier: Apache-2.0
// What a render kernel is compiled for.
#pragma once

#include <compare>
#include <cstdint>
#include <string>

#include "shaders/kernel_interface.h"

namespace blockwalk {

// The choices of shaders/kernel_interface.h, a word each, in the order of their ids.
struct KernelKey {
#define BLOCKWALK_MEMBER(id, type, member, constant, initial) std::uint32_t member = initial;
  BLOCKWALK_CHOICES(BLOCKWALK_MEMBER, BLOCKWALK_MEMBER)
#undef BLOCKWALK_MEMBER
  auto operator<=>(const KernelKey&) const = default;

  // Whether the finder asks the ray queries' structure: of the two modules the one that declares them.
  bool queriesRays() const {
    return finder == gpu::kFinderQuery || finder == gpu::kFinderClusters || finder == gpu::kFinderBoundary;
  }
};
constexpr std::uint32_t kKernelConstants = sizeof(KernelKey) / sizeof(std::uint32_t);

// What serves a key (renderer/vulkan/kernels.h).
enum class KernelWish : std::uint8_t {
  best,         // the key's own kernel, or the general one while it is made
  specialised,  // the key's own, also if that has to be made first
  general,      // its general kernel, to compare with
};

// "rgba8 blend grid walk cull ..." : what is compiled in, in words.
std::string describe(const KernelKey& key);

}  // namespace blockwalk
