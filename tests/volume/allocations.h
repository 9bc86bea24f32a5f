// SPDX-License-Identifier: Apache-2.0
// What the test program has taken by `new`, of all threads.
#pragma once

#include <cstdint>

namespace blockwalk::volume_test {

struct Allocations {
  std::uint64_t count = 0;  // since the program began
  std::uint64_t bytes = 0;  // that are held
  std::uint64_t most = 0;   // that were held at once since forgetMost()
};
Allocations allocations();
void forgetMost();

}  // namespace blockwalk::volume_test
