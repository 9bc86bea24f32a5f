// SPDX-License-Identifier: Apache-2.0
#include "volume/export/gzip_file.h"

#include <algorithm>
#include <new>

namespace blockwalk {
namespace {

constexpr std::size_t kPackedBytes = std::size_t{1} << 18;
constexpr int kGzipLevel = 3;         // half as fast, and 3 % shorter, is what the usual 6 is on scans
constexpr int kGzipWindow = 15 + 16;  // zlib's number for its largest window and a gzip header

}  // namespace

GzipFile::GzipFile(const std::filesystem::path& path) : file_(path), packed_(kPackedBytes) {
  if (deflateInit2(&stream_, kGzipLevel, Z_DEFLATED, kGzipWindow, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
}

GzipFile::~GzipFile() { deflateEnd(&stream_); }

void GzipFile::write(std::span<const std::byte> bytes) {
  constexpr std::size_t kMost = std::size_t{1} << 30;  // zlib counts in 32 bits
  while (!bytes.empty()) {
    const std::size_t count = std::min(bytes.size(), kMost);
    // zlib does not write there.
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
    stream_.avail_in = static_cast<uInt>(count);
    deflateAll(Z_NO_FLUSH);
    bytes = bytes.subspan(count);
  }
}

void GzipFile::deflateAll(int flush) {
  int result = Z_OK;
  do {
    stream_.next_out = reinterpret_cast<Bytef*>(packed_.data());
    stream_.avail_out = static_cast<uInt>(packed_.size());
    result = deflate(&stream_, flush);
    const std::size_t count = packed_.size() - stream_.avail_out;
    file_.write(written_, std::span(packed_).first(count));
    written_ += count;
  } while (flush == Z_FINISH ? result != Z_STREAM_END : stream_.avail_out == 0);
}

std::uint64_t GzipFile::commit() {
  deflateAll(Z_FINISH);
  file_.commit();
  return written_;
}

}  // namespace blockwalk
