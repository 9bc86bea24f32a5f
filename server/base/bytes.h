// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace blockwalk {

// Bytes that stay as long as this does, whatever they are a part of.
struct Bytes {
  std::shared_ptr<const void> owner = {};
  std::span<const std::byte> view = {};

  explicit operator bool() const { return owner != nullptr; }
  std::size_t size() const { return view.size(); }
};

inline Bytes ownBytes(std::vector<std::byte> bytes) {
  const auto owner = std::make_shared<const std::vector<std::byte>>(std::move(bytes));
  return {.owner = owner, .view = *owner};
}

inline Bytes textBytes(std::string_view text) {
  const auto* begin = reinterpret_cast<const std::byte*>(text.data());
  return ownBytes({begin, begin + text.size()});
}

}  // namespace blockwalk
