// SPDX-License-Identifier: Apache-2.0
#include "server/http/chunked_body.h"

#include <fmt/format.h>

#include <algorithm>

namespace blockwalk {
namespace {

constexpr int kMaxSizeDigits = 16;
constexpr std::size_t kMaxOverheadBytes = std::size_t{16} << 10;

int hexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace

std::size_t ChunkedBody::take(std::string_view bytes) {
  std::size_t taken = 0;
  while (taken < bytes.size() && !fault_ && state_ != State::done) {
    if (state_ == State::data) {
      const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(left_, bytes.size() - taken));
      text_.append(bytes.substr(taken, count));
      taken += count;
      left_ -= count;
      if (left_ == 0) state_ = State::data_end;
    } else {
      step(bytes[taken++]);
    }
  }
  return taken;
}

void ChunkedBody::step(char c) {
  switch (state_) {
    case State::size:
      return takeSizeDigit(c);
    case State::extension:
      countOverhead();
      if (c == '\n') return fail(400, "a chunk's size ends in CRLF");
      if (c == '\r') state_ = State::size_end;
      return;
    case State::size_end:
      if (c != '\n') return fail(400, "a chunk's size ends in CRLF");
      return beginChunk();
    case State::data_end:
      return expect(c, '\r', State::data_feed, "a chunk's data");
    case State::data_feed:
      digits_ = 0;
      size_ = 0;
      return expect(c, '\n', State::size, "a chunk's data");
    case State::trailer:
      countOverhead();
      if (c == '\n') return fail(400, "a trailer field ends in CRLF");
      state_ = c == '\r' ? State::trailer_feed : State::trailer_line;
      is_last_line_ = c == '\r';  // an empty line ends the body
      return;
    case State::trailer_line:
      countOverhead();
      if (c == '\n') return fail(400, "a trailer field ends in CRLF");
      if (c == '\r') state_ = State::trailer_feed;
      return;
    case State::trailer_feed:
      return expect(c, '\n', is_last_line_ ? State::done : State::trailer, "a trailer field");
    case State::data:
    case State::done:
      return;  // take() sees to both
  }
}

void ChunkedBody::takeSizeDigit(char c) {
  const int digit = hexDigit(c);
  if (digit >= 0) {
    if (++digits_ > kMaxSizeDigits) return fail(400, "a chunk's size has at most 16 digits");
    size_ = size_ * 16 + static_cast<std::uint64_t>(digit);
    return;
  }
  if (digits_ == 0) return fail(400, "a chunk begins with its size in hexadecimal digits");
  if (c == '\r') {
    state_ = State::size_end;
  } else if (c == ';' || c == ' ' || c == '\t') {
    state_ = State::extension;
  } else {
    fail(400, "a chunk's size ends in CRLF");
  }
}

void ChunkedBody::beginChunk() {
  if (size_ > limit_bytes_ - text_.size()) {
    return fail(413, fmt::format("a body has at most {} bytes", limit_bytes_));
  }
  left_ = size_;
  state_ = size_ == 0 ? State::trailer : State::data;
}

void ChunkedBody::expect(char c, char wanted, State next, const char* what) {
  if (c != wanted) return fail(400, fmt::format("{} ends in CRLF", what));
  state_ = next;
}

void ChunkedBody::countOverhead() {
  if (++overhead_ <= kMaxOverheadBytes) return;
  fail(400, fmt::format("a body's chunk extensions and trailers have at most {} bytes", kMaxOverheadBytes));
}

void ChunkedBody::fail(int status, std::string detail) {
  if (!fault_) fault_ = Problem{.status = status, .detail = std::move(detail), .field = "body"};
}

}  // namespace blockwalk
