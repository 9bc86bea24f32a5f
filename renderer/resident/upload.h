// SPDX-License-Identifier: Apache-2.0
// Fills a buffer piece by piece.
#pragma once

#include <functional>
#include <span>

#include "renderer/vulkan/buffer.h"

namespace blockwalk {

// Bytes that one piece of work brings to the device.
constexpr std::uint64_t kUploadPiece = std::uint64_t{16} << 20;

class Upload {
 public:
  // Records of `record_bytes` each, written by `fill(first, records)`, whose bytes are those from record `first` on.
  using Fill = std::function<void(std::size_t first, std::span<std::byte> records)>;
  Upload(Device& device, std::size_t count, std::uint64_t record_bytes, Fill fill)
      : device_(device),
        count_(count),
        record_bytes_(record_bytes),
        fill_(std::move(fill)),
        buffer_(device, count * record_bytes, BufferUse::resident) {}

  // One piece; true while there is more.
  bool advance();
  Buffer take() { return std::move(buffer_); }
  std::uint64_t bytes() const { return buffer_.bytes(); }

 private:
  Device& device_;
  std::size_t count_;
  std::uint64_t record_bytes_;
  Fill fill_;
  Buffer buffer_;
  std::size_t done_ = 0;
};

// Of values that are there. They must stay until it is done.
template <typename T>
Upload uploadOf(Device& device, std::span<const T> values) {
  return Upload(device, values.size(), sizeof(T), [values](std::size_t first, std::span<std::byte> records) {
    const auto bytes = std::as_bytes(values).subspan(first * sizeof(T), records.size());
    std::copy(bytes.begin(), bytes.end(), records.begin());
  });
}

}  // namespace blockwalk
