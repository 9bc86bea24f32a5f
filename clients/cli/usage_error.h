// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace blockwalk {

// The command line asks for something that cannot be; the text names the flag and the bound.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace blockwalk
