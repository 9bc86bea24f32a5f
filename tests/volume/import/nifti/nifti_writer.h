// SPDX-License-Identifier: Apache-2.0
// Headers of NIfTI for tests.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {

// A header that tests fill in: NIfTI-1, or NIfTI-2, in this machine's byte order or the other.
class NiftiFile {
 public:
  explicit NiftiFile(bool is_wide = false, bool is_swapped = false)
      : is_wide_(is_wide), is_swapped_(is_swapped), header_(is_wide ? 544 : 352, '\0') {
    put<std::int32_t>(0, is_wide ? 540 : 348);
    is_wide ? magic(std::string_view("n+2\0\r\n\x1a\n", 8)) : magic(std::string_view("n+1\0", 4));
    for (std::size_t i = 0; i < 8; ++i) dim(i, 1);
    for (std::size_t i = 0; i < 8; ++i) real(is_wide ? 104 : 76, i, 1);
    real2(168, 108, is_wide ? 544 : 352);
    type(2);
  }

  NiftiFile& magic(std::string_view text) {
    return set([&] { text.copy(&header_[is_wide_ ? 4 : 344], text.size()); });
  }
  NiftiFile& type(std::int16_t code) {
    return set([&] { put<std::int16_t>(is_wide_ ? 12 : 70, code); });
  }
  NiftiFile& dims(std::initializer_list<int> sizes) {
    dim(0, static_cast<int>(sizes.size()));
    std::size_t i = 0;
    for (const int size : sizes) dim(++i, size);
    return *this;
  }
  NiftiFile& pixdim(std::size_t i, double value) {
    return set([&] { real(is_wide_ ? 104 : 76, i, value); });
  }
  NiftiFile& slope(double scale, double offset) {
    return set([&] {
      real(is_wide_ ? 176 : 112, 0, scale);
      real(is_wide_ ? 176 : 112, 1, offset);
    });
  }
  NiftiFile& offset(double bytes) {
    return set([&] { real2(168, 108, bytes); });
  }
  NiftiFile& units(int code) {
    return set(
        [&] { is_wide_ ? put<std::int32_t>(500, code) : put<std::uint8_t>(123, static_cast<std::uint8_t>(code)); });
  }
  NiftiFile& intent(int code) {
    return set([&] { codeAt(504, 68, code); });
  }
  NiftiFile& sform(int code, const std::array<double, 12>& rows) {
    codeAt(348, 254, code);
    for (std::size_t i = 0; i < 12; ++i) real(is_wide_ ? 400 : 280, i, rows[i]);
    return *this;
  }
  NiftiFile& qform(int code, double factor, const std::array<double, 6>& values) {
    codeAt(344, 252, code);
    pixdim(0, factor);
    for (std::size_t i = 0; i < 6; ++i) real(is_wide_ ? 352 : 256, i, values[i]);
    return *this;
  }
  std::string bytes() const { return header_; }

 private:
  template <typename Change>
  NiftiFile& set(Change change) {
    change();
    return *this;
  }
  template <typename T>
  void put(std::size_t at, T value) {
    std::memcpy(&header_[at], &value, sizeof value);
    if (is_swapped_) std::reverse(&header_[at], &header_[at] + sizeof value);
  }
  void dim(std::size_t i, int size) {
    is_wide_ ? put<std::int64_t>(16 + 8 * i, size) : put<std::int16_t>(40 + 2 * i, static_cast<std::int16_t>(size));
  }
  void real(std::size_t at, std::size_t i, double value) {
    is_wide_ ? put<double>(at + 8 * i, value) : put<float>(at + 4 * i, static_cast<float>(value));
  }
  void real2(std::size_t wide, std::size_t narrow, double value) {
    is_wide_ ? put<std::int64_t>(wide, static_cast<std::int64_t>(value))
             : put<float>(narrow, static_cast<float>(value));
  }
  void codeAt(std::size_t wide, std::size_t narrow, int code) {
    is_wide_ ? put<std::int32_t>(wide, code) : put<std::int16_t>(narrow, static_cast<std::int16_t>(code));
  }

  bool is_wide_;
  bool is_swapped_;
  std::string header_;
};

}  // namespace blockwalk
