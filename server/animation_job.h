// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "protocol/animation_request.h"
#include "server/asked.h"

namespace blockwalk {

struct AnimationJob {
  std::shared_ptr<const ServedVolume> volume;
  std::shared_ptr<const Film> film;
  AnimationFormat format = AnimationFormat::zip;
  int quality = 85;
};

// What POST /volumes/{id}/animate asks for. Refusals are thrown.
AnimationJob readAnimationJob(const Asked& asked);

}  // namespace blockwalk
