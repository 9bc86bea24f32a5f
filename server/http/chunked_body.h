// SPDX-License-Identifier: Apache-2.0
// The chunked coding of a request's body (RFC 9112, 7.1), decoded strictly as its bytes arrive. No sockets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/problem.h"

namespace blockwalk {

// Lines end in CRLF and in nothing else; a size has 1 to 16 hexadecimal digits. Extensions and trailer fields are
// passed over, both within a bound. What is wrong is known with the byte that is wrong, never after a wait for more.
class ChunkedBody {
 public:
  explicit ChunkedBody(std::uint64_t limit_bytes) : limit_bytes_(limit_bytes) {}

  // Takes bytes from the front of `bytes` and returns how many: all, or up to the body's end or its fault.
  std::size_t take(std::string_view bytes);

  bool isDone() const { return state_ == State::done; }
  // Set once the body is refused; then nothing more is taken.
  const std::optional<Problem>& fault() const { return fault_; }
  std::string& text() { return text_; }

 private:
  enum class State { size, extension, size_end, data, data_end, data_feed, trailer, trailer_line, trailer_feed, done };

  void step(char c);
  void takeSizeDigit(char c);
  void beginChunk();
  void expect(char c, char wanted, State next, const char* what);
  void countOverhead();
  void fail(int status, std::string detail);

  std::uint64_t limit_bytes_;
  State state_ = State::size;
  int digits_ = 0;  // of the size so far
  bool is_last_line_ = false;
  std::uint64_t size_ = 0;    // of the chunk that is being read
  std::uint64_t left_ = 0;    // of its data
  std::size_t overhead_ = 0;  // bytes of extensions and trailers so far
  std::string text_;
  std::optional<Problem> fault_;
};

}  // namespace blockwalk
