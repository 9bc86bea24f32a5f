// SPDX-License-Identifier: Apache-2.0
#include "volume/import/bunzip.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "volume/error.h"

namespace blockwalk {
namespace {
constexpr std::size_t kBunzipInputBytes = std::size_t{1} << 18;
}  // namespace

BunzipStream::BunzipStream(std::shared_ptr<const InputFile> file, std::uint64_t first)
    : file_(std::move(file)), first_(first), position_(first), input_(kBunzipInputBytes) {
  begin();
}

BunzipStream::~BunzipStream() { BZ2_bzDecompressEnd(&state_); }

// Keeps the input that is not yet unpacked.
void BunzipStream::begin() {
  char* const next = state_.next_in;
  const unsigned left = state_.avail_in;
  state_ = {};
  const int result = BZ2_bzDecompressInit(&state_, 0, 0);
  if (result != BZ_OK) failData("{}: no memory to unpack bzip2", file_->name());
  state_.next_in = next;
  state_.avail_in = left;
}

void BunzipStream::restart() {
  BZ2_bzDecompressEnd(&state_);
  state_ = {};
  begin();
  position_ = first_;
  ended_ = false;
}

bool BunzipStream::fill() {
  const std::size_t got = file_->readSome(position_, std::as_writable_bytes(std::span(input_)));
  position_ += got;
  state_.next_in = input_.data();
  state_.avail_in = static_cast<unsigned>(got);
  return got > 0;
}

void BunzipStream::endMember() {
  if ((state_.avail_in == 0 && !fill()) || *state_.next_in != 'B') {
    ended_ = true;
    return;
  }
  BZ2_bzDecompressEnd(&state_);
  begin();
}

std::size_t BunzipStream::read(std::span<std::byte> out) {
  std::size_t done = 0;
  while (done < out.size() && !ended_) {
    if (state_.avail_in == 0 && !fill()) {
      failData("{}: the compressed data is cut off at byte {}", file_->name(), position_);
    }
    const std::size_t piece = std::min<std::size_t>(out.size() - done, std::numeric_limits<unsigned>::max());
    state_.next_out = reinterpret_cast<char*>(out.data() + done);
    state_.avail_out = static_cast<unsigned>(piece);
    const int result = BZ2_bzDecompress(&state_);
    done += piece - state_.avail_out;
    if (result == BZ_STREAM_END) {
      endMember();
    } else if (result != BZ_OK) {
      failData("{}: the bzip2 data is broken near byte {}", file_->name(), position_ - state_.avail_in);
    }
  }
  return done;
}

}  // namespace blockwalk
