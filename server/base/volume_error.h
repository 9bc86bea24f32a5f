// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "volume/error.h"

namespace blockwalk {

// The volume's file could not be loaded, or broke while it was served. The text names the file without its folder.
struct VolumeError : DataError {
  using DataError::DataError;
};

}  // namespace blockwalk
