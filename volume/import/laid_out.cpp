// SPDX-License-Identifier: Apache-2.0
// Arrays where text headers say that they lie.
#include <algorithm>
#include <mutex>
#include <utility>

#include "volume/error.h"
#include "volume/import/byte_reader.h"

namespace blockwalk {
namespace {

// A header in front of voxels that are the last bytes of a stream is at most this long.
constexpr std::uint64_t kMostInFront = std::uint64_t{1} << 24;

class RemarkedBytes final : public ByteReader {
 public:
  RemarkedBytes(std::unique_ptr<ByteReader> bytes, std::string remark)
      : bytes_(std::move(bytes)), remark_(std::move(remark)) {}
  bool randomAccess() const override { return bytes_->randomAccess(); }
  bool hasHoles() const override { return bytes_->hasHoles(); }
  ByteRange dataFrom(std::uint64_t offset) const override { return bytes_->dataFrom(offset); }
  void read(std::uint64_t offset, std::span<std::byte> out) override { bytes_->read(offset, out); }
  std::string remark() const override { return remark_; }

 private:
  std::unique_ptr<ByteReader> bytes_;
  std::string remark_;
};

std::unique_ptr<ByteReader> readPlain(const std::shared_ptr<const InputFile>& file, const DataLayout& layout,
                                      std::uint64_t bytes) {
  if (layout.byte_skip == -1) {
    if (bytes > file->bytes()) {
      failData("{}: {}: {} bytes of voxels are declared, the file has {}", file->name(), layout.field, bytes,
               file->bytes());
    }
    return readFileBytes(file, file->bytes() - bytes, bytes);
  }
  const std::uint64_t begin = firstByte(*file, layout);
  const auto skip = static_cast<std::uint64_t>(layout.byte_skip);
  const std::uint64_t left = file->bytes() - std::min(begin, file->bytes());
  if (skip > left || left - skip < bytes) {
    failData("{}: {}: {} bytes of voxels are declared, {} are there from byte {} on", file->name(), layout.field, bytes,
             left - std::min(skip, left), begin + skip);
  }
  auto voxels = readFileBytes(file, begin + skip, bytes);
  const std::uint64_t behind = left - skip - bytes;
  if (behind == 0) return voxels;
  return std::make_unique<RemarkedBytes>(
      std::move(voxels), fmt::format("{}: {} bytes behind the voxels are passed over", file->name(), behind));
}

class PartFiles final : public ByteReader {
 public:
  PartFiles(std::vector<std::filesystem::path> files, DataLayout layout, std::uint64_t part_bytes)
      : files_(std::move(files)), layout_(std::move(layout)), part_bytes_(part_bytes) {
    // All are looked at now: what is missing is said before anything is written.
    for (std::size_t i = 0; i < files_.size(); ++i) {
      const auto part = open(i);
      if (remark_.empty()) remark_ = part->remark();
    }
  }
  bool randomAccess() const override { return layout_.packing == Packing::none; }
  std::string remark() const override { return remark_; }

  void read(std::uint64_t offset, std::span<std::byte> out) override {
    while (!out.empty()) {
      const std::uint64_t within = offset % part_bytes_;
      const std::size_t piece = std::min<std::uint64_t>(out.size(), part_bytes_ - within);
      const auto part = partAt(offset / part_bytes_);
      part->read(within, out.first(piece));
      if (!randomAccess() && remark_.empty()) remark_ = part->remark();
      out = out.subspan(piece);
      offset += piece;
    }
  }

 private:
  std::unique_ptr<ByteReader> open(std::size_t index) const {
    return readLaidOut(std::make_shared<InputFile>(files_[index]), layout_, part_bytes_);
  }

  std::shared_ptr<ByteReader> partAt(std::size_t index) {
    const std::lock_guard lock(mutex_);
    if (part_ == nullptr || index != index_) {
      part_ = open(index);
      index_ = index;
    }
    return part_;
  }

  std::vector<std::filesystem::path> files_;
  DataLayout layout_;
  std::uint64_t part_bytes_;
  std::string remark_;
  std::mutex mutex_;
  std::shared_ptr<ByteReader> part_;
  std::size_t index_ = 0;
};

}  // namespace

std::uint64_t firstByte(const InputFile& file, const DataLayout& layout) {
  std::vector<std::byte> buffer(layout.line_skip > 0 ? std::size_t{1} << 16 : 0);
  std::uint64_t begin = layout.begin;
  std::uint64_t found = 0;
  while (found < layout.line_skip) {
    const std::size_t got = file.readSome(begin, buffer);
    if (got == 0) {
      failData("{}: line skip: the file has {} lines, {} are to be skipped", file.name(), found, layout.line_skip);
    }
    std::size_t used = 0;
    while (used < got && found < layout.line_skip) found += buffer[used++] == std::byte{'\n'} ? 1 : 0;
    begin += used;
  }
  return begin;
}

std::unique_ptr<ByteReader> readLaidOut(std::shared_ptr<const InputFile> file, const DataLayout& layout,
                                        std::uint64_t bytes) {
  if (layout.packing == Packing::none) return readPlain(file, layout, bytes);
  const std::uint64_t begin = firstByte(*file, layout);
  if (layout.byte_skip != -1) {
    return readPackedBytes(layout.packing, file, begin, static_cast<std::uint64_t>(layout.byte_skip), bytes,
                           Behind::passed);
  }
  // The voxels are the last bytes of a stream whose length only unpacking tells.
  const std::uint64_t all = unpackedBytes(layout.packing, *file, begin, bytes + kMostInFront);
  if (all < bytes) {
    failData("{}: {}: {} bytes are declared, the data unpacks to {}", file->name(), layout.field, bytes, all);
  }
  return readPackedBytes(layout.packing, file, begin, all - bytes, bytes, Behind::passed);
}

std::unique_ptr<ByteReader> readLaidOutParts(std::vector<std::filesystem::path> files, const DataLayout& layout,
                                             std::uint64_t part_bytes) {
  BLOCKWALK_CHECK(part_bytes, >, std::uint64_t{0});
  return std::make_unique<PartFiles>(std::move(files), layout, part_bytes);
}

}  // namespace blockwalk
