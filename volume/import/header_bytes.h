// SPDX-License-Identifier: Apache-2.0
// Reading the binary headers of image files: numbers of either byte order at fixed places.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

namespace blockwalk {

// The caller stays inside the bytes.
class HeaderBytes {
 public:
  HeaderBytes(std::span<const std::byte> bytes, std::endian order) : bytes_(bytes), order_(order) {}

  std::size_t size() const { return bytes_.size(); }
  bool swaps() const { return order_ != std::endian::native; }

  std::uint8_t u8(std::size_t at) const { return std::to_integer<std::uint8_t>(bytes_[at]); }
  std::uint16_t u16(std::size_t at) const { return static_cast<std::uint16_t>(number(at, 2)); }
  std::uint32_t u32(std::size_t at) const { return static_cast<std::uint32_t>(number(at, 4)); }
  std::uint64_t u64(std::size_t at) const { return number(at, 8); }
  std::int32_t i32(std::size_t at) const { return static_cast<std::int32_t>(u32(at)); }
  std::int64_t i64(std::size_t at) const { return static_cast<std::int64_t>(u64(at)); }
  float f32(std::size_t at) const { return std::bit_cast<float>(u32(at)); }
  double f64(std::size_t at) const { return std::bit_cast<double>(u64(at)); }
  // Up to a NUL.
  std::string text(std::size_t at, std::size_t most) const {
    const char* begin = reinterpret_cast<const char*>(bytes_.data()) + at;
    return {begin, strnlen(begin, most)};
  }

 private:
  std::uint64_t number(std::size_t at, std::size_t width) const {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < width; ++i) {
      const std::size_t place = order_ == std::endian::big ? at + i : at + width - 1 - i;
      value = value << 8 | std::to_integer<std::uint64_t>(bytes_[place]);
    }
    return value;
  }

  std::span<const std::byte> bytes_;
  std::endian order_;
};

}  // namespace blockwalk
