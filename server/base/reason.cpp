// SPDX-License-Identifier: Apache-2.0
#include "server/base/reason.h"

#include <new>

namespace blockwalk {

std::string reasonOf(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const std::bad_alloc&) {
    return "the server is out of memory";
  } catch (const std::exception& error) {
    return error.what();
  }
}

}  // namespace blockwalk
