// SPDX-License-Identifier: Apache-2.0
// The two kinds of failure that this room knows.
//
// DataError: the input is broken, hostile or out of bounds. Its text names the file, the field or offset, and the
// bound. BLOCKWALK_CHECK: a programmer's error. Stays in release builds, prints both values, aborts.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <utility>

namespace blockwalk {

struct DataError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

template <typename... Args>
[[noreturn]] void failData(fmt::format_string<Args...> format, Args&&... args) {
  throw DataError(fmt::format(format, std::forward<Args>(args)...));
}

template <typename A, typename B>
[[noreturn]] void failCheck(const char* file, int line, const char* text, const A& a, const B& b) {
  fmt::print(stderr, "{}:{}: check failed: {} (left {}, right {})\n", file, line, text, a, b);
  std::abort();
}

}  // namespace blockwalk

// BLOCKWALK_CHECK(index, <, count)
#define BLOCKWALK_CHECK(a, op, b)                                                      \
  do {                                                                                 \
    const auto& check_a = (a);                                                         \
    const auto& check_b = (b);                                                         \
    if (!(check_a op check_b)) {                                                       \
      ::blockwalk::failCheck(__FILE__, __LINE__, #a " " #op " " #b, check_a, check_b); \
    }                                                                                  \
  } while (false)
