// SPDX-License-Identifier: Apache-2.0
// Values to and from bytes as they lie in memory.
#pragma once

#include <cstddef>
#include <cstring>
#include <vector>

namespace blockwalk {

template <typename T>
void appendPlain(std::vector<std::byte>& out, const T& value) {
  const auto* bytes = reinterpret_cast<const std::byte*>(&value);
  out.insert(out.end(), bytes, bytes + sizeof value);
}

// There must be as many; goes on behind them.
template <typename T>
T takePlain(const std::byte*& at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  at += sizeof value;
  return value;
}

}  // namespace blockwalk
