// SPDX-License-Identifier: Apache-2.0
#include "volume/import/byte_reader.h"

#include <algorithm>
#include <utility>

#include "volume/error.h"
#include "volume/import/inflate.h"

namespace blockwalk {
namespace {

class FileBytes final : public ByteReader {
 public:
  FileBytes(std::shared_ptr<const InputFile> file, std::uint64_t first, std::uint64_t bytes)
      : file_(std::move(file)), first_(first) {
    const ByteRange data = file_->dataFrom(first);
    has_holes_ = data.begin > first || data.end < first + bytes;
  }
  bool randomAccess() const override { return true; }
  void read(std::uint64_t offset, std::span<std::byte> out) override { file_->read(first_ + offset, out); }
  bool hasHoles() const override { return has_holes_; }
  ByteRange dataFrom(std::uint64_t offset) const override {
    const ByteRange data = file_->dataFrom(first_ + offset);
    return {data.begin - first_, data.end - first_};
  }

 private:
  std::shared_ptr<const InputFile> file_;
  std::uint64_t first_;
  bool has_holes_ = false;
};

class MemoryBytes final : public ByteReader {
 public:
  explicit MemoryBytes(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}
  bool randomAccess() const override { return true; }
  void read(std::uint64_t offset, std::span<std::byte> out) override {
    BLOCKWALK_CHECK(offset + out.size(), <=, bytes_.size());
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
  }

 private:
  std::vector<std::byte> bytes_;
};

// How far past the declared end a stream is followed to say how much too long it is.
constexpr std::uint64_t kExcessBytes = std::uint64_t{1} << 20;

class CompressedBytes final : public ByteReader {
 public:
  CompressedBytes(std::shared_ptr<const InputFile> file, std::uint64_t first, std::uint64_t skip, std::uint64_t bytes)
      : stream_(std::move(file), first), skip_(skip), bytes_(bytes) {}
  bool randomAccess() const override { return false; }

  void read(std::uint64_t offset, std::span<std::byte> out) override {
    if (offset == 0) begin();
    BLOCKWALK_CHECK(offset, ==, next_);
    BLOCKWALK_CHECK(offset + out.size(), <=, bytes_);
    const std::size_t got = stream_.read(out);
    if (got != out.size()) {
      failData("{}: the compressed data unpacks to {} bytes, {} were declared", stream_.name(), skip_ + next_ + got,
               skip_ + bytes_);
    }
    next_ += got;
    if (next_ == bytes_) checkEnd();
  }

 private:
  void begin() {
    stream_.restart();
    next_ = 0;
    const std::uint64_t skipped = stream_.skip(skip_);
    if (skipped != skip_) {
      failData("{}: the compressed data unpacks to {} bytes, {} were declared", stream_.name(), skipped,
               skip_ + bytes_);
    }
  }
  void checkEnd() {
    const std::uint64_t excess = stream_.skip(kExcessBytes);
    if (excess == 0) return;
    failData("{}: the compressed data unpacks to {}{} bytes, {} were declared", stream_.name(),
             excess == kExcessBytes ? "at least " : "", skip_ + bytes_ + excess, skip_ + bytes_);
  }

  InflateStream stream_;
  std::uint64_t skip_;
  std::uint64_t bytes_;
  std::uint64_t next_ = 0;
};

}  // namespace

std::unique_ptr<ByteReader> readFileBytes(std::shared_ptr<const InputFile> file, std::uint64_t first,
                                          std::uint64_t bytes) {
  if (first > file->bytes() || bytes > file->bytes() - first) {
    failData("{}: {} bytes of voxels from byte {} were declared, the file has {} bytes", file->name(), bytes, first,
             file->bytes());
  }
  return std::make_unique<FileBytes>(std::move(file), first, bytes);
}

std::unique_ptr<ByteReader> readMemoryBytes(std::vector<std::byte> bytes) {
  return std::make_unique<MemoryBytes>(std::move(bytes));
}

std::unique_ptr<ByteReader> readCompressedBytes(std::shared_ptr<const InputFile> file, std::uint64_t first,
                                                std::uint64_t skip, std::uint64_t bytes) {
  return std::make_unique<CompressedBytes>(std::move(file), first, skip, bytes);
}

std::uint64_t unpackedBytes(const InputFile& file, std::uint64_t first, std::uint64_t limit) {
  // The stream shares ownership of nothing here: `file` outlives it.
  InflateStream stream(std::shared_ptr<const InputFile>(std::shared_ptr<void>(), &file), first);
  const std::uint64_t bytes = stream.skip(limit + 1);
  if (bytes > limit) failData("{}: the compressed data unpacks to more than {} bytes", file.name(), limit);
  return bytes;
}

}  // namespace blockwalk
