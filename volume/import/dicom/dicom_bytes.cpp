// SPDX-License-Identifier: Apache-2.0
#include "volume/import/dicom/dicom_bytes.h"

#include <algorithm>

#include "volume/error.h"

namespace blockwalk {

void DicomBytes::inflateFrom(std::uint64_t begin) {
  begin_ = begin;
  at_ = begin;
  stream_ = std::make_unique<InflateStream>(file_, begin, true);
}

void DicomBytes::measureFrom(std::uint64_t begin) {
  constexpr std::uint64_t kMostBytes = (std::uint64_t{1} << 32) + (std::uint64_t{1} << 26);
  inflateFrom(begin);
  const std::uint64_t length = stream_->skip(kMostBytes);
  if (length == kMostBytes) failData("{}: the deflated data set has more than {} bytes", name(), kMostBytes);
  bytes_ = begin + length;
  at_ = *bytes_;
}

std::size_t DicomBytes::readSome(std::uint64_t offset, std::span<std::byte> out) {
  if (!stream_) return file_->readSome(offset, out);
  std::size_t done = 0;
  if (offset < begin_) {
    done = file_->readSome(offset, out.first(std::min<std::uint64_t>(out.size(), begin_ - offset)));
    if (done == out.size()) return done;
    offset = begin_;
  }
  if (offset < at_) {
    stream_->restart();
    at_ = begin_;
  }
  at_ += stream_->skip(offset - at_);
  if (at_ < offset) return done;
  const std::size_t got = stream_->read(out.subspan(done));
  at_ += got;
  return done + got;
}

void DicomBytes::read(std::uint64_t offset, std::span<std::byte> out) {
  const std::size_t got = readSome(offset, out);
  if (got != out.size()) {
    failData("{}: the file ends at byte {}, byte {} was asked for", name(), offset + got, offset + out.size());
  }
}

}  // namespace blockwalk
