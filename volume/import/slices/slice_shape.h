// SPDX-License-Identifier: Apache-2.0
// What all slices of a stack have in common.
#pragma once

#include <fmt/format.h>

#include <string>

#include "volume/import/convert/sample.h"

namespace blockwalk {

struct SliceShape {
  int width = 0;
  int height = 0;
  SampleFormat format;
  bool operator==(const SliceShape&) const = default;

  std::string text() const {
    return fmt::format("{} x {} pixels of {} x {}", width, height, format.channels, sampleTypeName(format.type));
  }
};

}  // namespace blockwalk
