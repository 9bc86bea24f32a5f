// SPDX-License-Identifier: Apache-2.0
#include "volume/import/byte_reader.h"

#include <algorithm>
#include <utility>

#include "volume/error.h"

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
// A line feed or padding. More of unpacked data says that the voxels are not where the header has them.
constexpr std::uint64_t kMostPassed = 64;

class PackedBytes final : public ByteReader {
 public:
  PackedBytes(std::unique_ptr<PackedStream> stream, std::uint64_t skip, std::uint64_t bytes, Behind behind)
      : stream_(std::move(stream)), skip_(skip), bytes_(bytes), behind_(behind) {}
  bool randomAccess() const override { return false; }
  std::string remark() const override { return remark_; }

  void read(std::uint64_t offset, std::span<std::byte> out) override {
    if (offset == 0) begin();
    BLOCKWALK_CHECK(offset, ==, next_);
    BLOCKWALK_CHECK(offset + out.size(), <=, bytes_);
    const std::size_t got = stream_->read(out);
    if (got != out.size()) {
      failData("{}: the compressed data unpacks to {} bytes, {} were declared", stream_->name(), skip_ + next_ + got,
               skip_ + bytes_);
    }
    next_ += got;
    if (next_ == bytes_ && behind_ != Behind::expected) checkEnd();
  }

 private:
  void begin() {
    stream_->restart();
    next_ = 0;
    const std::uint64_t skipped = stream_->skip(skip_);
    if (skipped != skip_) {
      failData("{}: the compressed data unpacks to {} bytes, {} were declared", stream_->name(), skipped,
               skip_ + bytes_);
    }
  }
  void checkEnd() {
    const std::uint64_t excess = stream_->skip(kExcessBytes);
    const std::uint64_t behind = stream_->bytesBehind();
    if (excess == 0 && behind == 0) return;
    const std::string what =
        excess > 0 ? fmt::format("the compressed data unpacks to {}{} bytes, {} were declared",
                                 excess == kExcessBytes ? "at least " : "", skip_ + bytes_ + excess, skip_ + bytes_)
                   : fmt::format("{} bytes follow the end of the compressed data", behind);
    const bool is_much = excess > kMostPassed || excess > bytes_ / 8;
    if (behind_ == Behind::nothing || is_much) failData("{}: {}", stream_->name(), what);
    remark_ = fmt::format("{}: {}; what is behind the voxels is passed over", stream_->name(), what);
  }

  std::unique_ptr<PackedStream> stream_;
  std::uint64_t skip_;
  std::uint64_t bytes_;
  Behind behind_;
  std::uint64_t next_ = 0;
  std::string remark_;
};

class PartBytes final : public ByteReader {
 public:
  PartBytes(std::unique_ptr<ByteReader> whole, std::uint64_t first) : whole_(std::move(whole)), first_(first) {}
  bool randomAccess() const override { return whole_->randomAccess(); }
  bool hasHoles() const override { return whole_->hasHoles(); }
  std::string remark() const override { return whole_->remark(); }
  ByteRange dataFrom(std::uint64_t offset) const override {
    const ByteRange data = whole_->dataFrom(first_ + offset);
    return {data.begin - first_, data.end - first_};
  }
  void read(std::uint64_t offset, std::span<std::byte> out) override {
    if (offset == 0 && !randomAccess()) passOver();
    whole_->read(first_ + offset, out);
  }

 private:
  void passOver() {
    std::vector<std::byte> waste(std::min(first_, kExcessBytes));
    for (std::uint64_t done = 0; done < first_;) {
      const auto piece = std::span(waste).first(std::min<std::uint64_t>(waste.size(), first_ - done));
      whole_->read(done, piece);
      done += piece.size();
    }
  }

  std::unique_ptr<ByteReader> whole_;
  std::uint64_t first_;
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

std::unique_ptr<ByteReader> readPackedBytes(Packing packing, std::shared_ptr<const InputFile> file, std::uint64_t first,
                                            std::uint64_t skip, std::uint64_t bytes, Behind behind) {
  return std::make_unique<PackedBytes>(openPacked(packing, std::move(file), first), skip, bytes, behind);
}

std::unique_ptr<ByteReader> readPart(std::unique_ptr<ByteReader> whole, std::uint64_t first, std::uint64_t bytes) {
  BLOCKWALK_CHECK(bytes, >, std::uint64_t{0});
  if (first == 0) return whole;
  return std::make_unique<PartBytes>(std::move(whole), first);
}

std::uint64_t unpackedBytes(Packing packing, const InputFile& file, std::uint64_t first, std::uint64_t limit) {
  // The stream shares ownership of nothing here: `file` outlives it.
  const auto stream = openPacked(packing, std::shared_ptr<const InputFile>(std::shared_ptr<void>(), &file), first);
  const std::uint64_t bytes = stream->skip(limit + 1);
  if (bytes > limit) failData("{}: the compressed data unpacks to more than {} bytes", file.name(), limit);
  return bytes;
}

}  // namespace blockwalk
