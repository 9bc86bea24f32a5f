// SPDX-License-Identifier: Apache-2.0
// What people call the codecs: flags, JSON and messages.
#pragma once

#include <string_view>

#include "volume/volume.h"

namespace blockwalk {

constexpr std::string_view codecName(Codec codec) {
  switch (codec) {
    case Codec::raw:
      return "raw";
    case Codec::lz4:
      return "lz4";
    case Codec::zstd:
      return "zstd";
  }
  return "";
}

}  // namespace blockwalk
