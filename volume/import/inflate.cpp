// SPDX-License-Identifier: Apache-2.0
#include "volume/import/inflate.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "volume/error.h"

namespace blockwalk {
namespace {
constexpr std::size_t kInputBytes = std::size_t{1} << 18;
constexpr int kGzipOrZlib = 32 + MAX_WBITS;

int windowBits(bool is_bare) { return is_bare ? -MAX_WBITS : kGzipOrZlib; }
}  // namespace

InflateStream::InflateStream(std::shared_ptr<const InputFile> file, std::uint64_t first, bool is_bare)
    : file_(std::move(file)), first_(first), is_bare_(is_bare), position_(first), input_(kInputBytes) {
  const int result = inflateInit2(&zlib_, windowBits(is_bare_));
  BLOCKWALK_CHECK(result, ==, Z_OK);
}

InflateStream::~InflateStream() { inflateEnd(&zlib_); }

void InflateStream::restart() {
  inflateReset2(&zlib_, windowBits(is_bare_));
  zlib_.avail_in = 0;
  position_ = first_;
  ended_ = false;
}

bool InflateStream::fill() {
  const std::size_t got = file_->readSome(position_, input_);
  position_ += got;
  zlib_.next_in = reinterpret_cast<Bytef*>(input_.data());
  zlib_.avail_in = static_cast<uInt>(got);
  return got > 0;
}

void InflateStream::endMember() {
  if (is_bare_ || (zlib_.avail_in == 0 && !fill()) || *zlib_.next_in != 0x1f) {
    ended_ = true;
    return;
  }
  inflateReset2(&zlib_, kGzipOrZlib);
}

std::size_t InflateStream::read(std::span<std::byte> out) {
  std::size_t done = 0;
  while (done < out.size() && !ended_) {
    if (zlib_.avail_in == 0 && !fill()) {
      failData("{}: the compressed data is cut off at byte {}", file_->name(), position_);
    }
    const std::size_t piece = std::min<std::size_t>(out.size() - done, std::numeric_limits<uInt>::max());
    zlib_.next_out = reinterpret_cast<Bytef*>(out.data() + done);
    zlib_.avail_out = static_cast<uInt>(piece);
    const int result = inflate(&zlib_, Z_NO_FLUSH);
    done += piece - zlib_.avail_out;
    if (result == Z_STREAM_END) {
      endMember();
    } else if (result != Z_OK) {
      failData("{}: the compressed data is broken near byte {}: {}", file_->name(), position_ - zlib_.avail_in,
               zlib_.msg != nullptr ? zlib_.msg : "no progress");
    }
  }
  return done;
}

}  // namespace blockwalk
