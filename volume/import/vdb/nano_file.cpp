// SPDX-License-Identifier: Apache-2.0
#include "volume/import/vdb/nano_file.h"

#include <algorithm>
#include <array>
#include <utility>

#include "volume/error.h"
#include "volume/import/header_bytes.h"
#include "volume/import/vdb/grid_choice.h"
#include "volume/import/zarr/zarr_codec.h"
#include "volume/plain_text.h"

namespace blockwalk {
namespace {

constexpr std::size_t kWindowBytes = std::size_t{1} << 20;
constexpr std::uint32_t kMostNameBytes = 1 << 16;
constexpr std::size_t kMostKeptNameBytes = 1024;
constexpr std::uint64_t kChunkBytes = std::uint64_t{1} << 30;  // of what blosc packs at a time

std::vector<std::byte> bytesAt(const InputFile& file, std::uint64_t offset, std::size_t count) {
  std::vector<std::byte> bytes(count);
  file.read(offset, bytes);
  return bytes;
}

std::string nameIn(std::span<const std::byte> bytes, std::size_t at, std::size_t most) {
  return most == 0 ? "" : plainText(HeaderBytes(bytes, std::endian::little).text(at, most));
}

// One grid alone has its version elsewhere than a segment.
bool isBareGrid(const InputFile& file) {
  std::vector<std::byte> start(nano::grid::kVersion + 4);
  if (file.readSome(0, start) != start.size()) return false;
  const HeaderBytes head(start, std::endian::little);
  const std::uint8_t mark = head.u8(nano::kMagic.size());
  if (mark != '0') return mark == '1';
  return nano::majorOf(head.u32(nano::segment::kVersion)) != nano::kMajorVersion;
}

class SegmentReader {
 public:
  explicit SegmentReader(const InputFile& file) : file_(file) {}

  std::vector<NanoEntry> read() {
    while (at_ < file_.bytes()) readSegment();
    return std::move(entries_);
  }

 private:
  void readSegment() {
    const auto bytes = bytesAt(file_, at_, nano::segment::kBytes);
    const HeaderBytes head(bytes, std::endian::little);
    if (head.text(0, nano::kMagic.size()) != nano::kMagic) {
      failData("{}: byte {}: a segment must begin with {}", file_.name(), at_, nano::kMagic);
    }
    checkVersion(head.u32(nano::segment::kVersion));
    const std::size_t count = head.u16(nano::segment::kGridCount);
    at_ += nano::segment::kBytes;
    if (entries_.size() + count > kMostGrids) failData("{}: holds more than {} grids", file_.name(), kMostGrids);
    const std::size_t first = entries_.size();
    for (std::size_t i = 0; i < count; ++i) readRecord();
    for (std::size_t i = first; i < entries_.size(); ++i) {
      NanoEntry& entry = entries_[i];
      entry.offset = at_;
      if (entry.file_bytes > file_.bytes() - at_) {
        failData("{}: grid '{}': {} bytes from byte {} are declared, the file has {}", file_.name(), entry.name,
                 entry.file_bytes, at_, file_.bytes());
      }
      at_ += entry.file_bytes;
    }
  }

  void checkVersion(std::uint32_t version) const {
    if (nano::majorOf(version) == nano::kMajorVersion) return;
    failData("{}: version: {} is not {}, the one that is read", file_.name(), nano::majorOf(version),
             nano::kMajorVersion);
  }

  void readRecord() {
    const auto bytes = bytesAt(file_, at_, nano::record::kBytes);
    const HeaderBytes record(bytes, std::endian::little);
    const std::uint32_t name_bytes = record.u32(nano::record::kNameBytes);
    if (name_bytes > kMostNameBytes) {
      failData("{}: nameSize: {} bytes, must be at most {}", file_.name(), name_bytes, kMostNameBytes);
    }
    at_ += nano::record::kBytes;
    const auto name = bytesAt(file_, at_, name_bytes);
    at_ += name_bytes;
    NanoEntry entry{.name = nameIn(name, 0, std::min<std::size_t>(name_bytes, kMostKeptNameBytes)),
                    .codec = static_cast<nano::Codec>(record.u16(nano::record::kCodec)),
                    .file_bytes = record.u64(nano::record::kFileBytes),
                    .grid_bytes = record.u64(nano::record::kGridBytes)};
    if (entry.codec > nano::Codec::blosc) {
      failData("{}: grid '{}': codec: {} is none that is known", file_.name(), entry.name,
               static_cast<unsigned>(entry.codec));
    }
    if (entry.codec == nano::Codec::none && entry.grid_bytes != entry.file_bytes) {
      failData("{}: grid '{}': fileSize: {} bytes, must be its {}", file_.name(), entry.name, entry.file_bytes,
               entry.grid_bytes);
    }
    entries_.push_back(std::move(entry));
  }

  const InputFile& file_;
  std::uint64_t at_ = 0;
  std::vector<NanoEntry> entries_;
};

}  // namespace

std::vector<NanoEntry> nanoEntries(const InputFile& file) {
  if (!isBareGrid(file)) return SegmentReader(file).read();
  const auto bytes = bytesAt(file, 0, nano::grid::kBytes);
  const HeaderBytes head(bytes, std::endian::little);
  const std::uint64_t grid_bytes = head.u64(nano::grid::kGridBytes);
  if (grid_bytes > file.bytes()) {
    failData("{}: gridSize: {} bytes are declared, the file has {}", file.name(), grid_bytes, file.bytes());
  }
  return {{.name = nameIn(bytes, nano::grid::kName, nano::grid::kNameBytes),
           .offset = 0,
           .file_bytes = grid_bytes,
           .grid_bytes = grid_bytes}};
}

NanoBytes::NanoBytes(std::shared_ptr<const InputFile> file, const NanoEntry& entry, std::uint64_t most_bytes)
    : file_(std::move(file)),
      name_(fmt::format("{}: grid '{}'", file_->name(), entry.name)),
      size_(entry.grid_bytes),
      first_(entry.offset),
      is_packed_(entry.codec != nano::Codec::none) {
  if (!is_packed_) return;
  if (size_ > most_bytes || entry.file_bytes > most_bytes) {
    failData("{}: {} bytes, packed {}, must be at most {}, an eighth of --memory", name_, size_, entry.file_bytes,
             most_bytes);
  }
  unpack(entry);
}

void NanoBytes::unpack(const NanoEntry& entry) {
  const bool is_zip = entry.codec == nano::Codec::zip;
  const ZarrCodec codec = is_zip ? ZarrCodec::zlib : ZarrCodec::blosc;
  std::uint64_t at = entry.offset;
  std::uint64_t left = entry.file_bytes;
  while (window_.size() < size_) {
    if (left < 8) fail(fmt::format("its packed bytes end after {} of {}", window_.size(), size_));
    const auto head = bytesAt(*file_, at, 8);
    const std::uint64_t packed_bytes = HeaderBytes(head, std::endian::little).u64(0);
    at += 8;
    left -= 8;
    if (packed_bytes > left) fail(fmt::format("{} packed bytes are declared, {} are left", packed_bytes, left));
    const std::uint64_t bytes = is_zip ? size_ : std::min(size_ - window_.size(), kChunkBytes);
    auto chunk = unpackZarr(bytesAt(*file_, at, packed_bytes), std::span(&codec, 1), bytes, name_);
    at += packed_bytes;
    left -= packed_bytes;
    if (window_.empty()) {
      window_ = std::move(chunk);
    } else {
      window_.insert(window_.end(), chunk.begin(), chunk.end());
    }
  }
}

std::span<const std::byte> NanoBytes::get(std::uint64_t offset, std::size_t bytes) {
  if (offset > size_ || bytes > size_ - offset) {
    fail(fmt::format("{} bytes at byte {} are asked for, it has {}", bytes, offset, size_));
  }
  if (is_packed_) return std::span<const std::byte>(window_).subspan(offset, bytes);
  if (offset < window_begin_ || offset + bytes > window_begin_ + window_.size()) {
    window_.resize(std::min<std::uint64_t>(std::max(kWindowBytes, bytes), size_ - offset));
    window_begin_ = offset;
    file_->read(first_ + offset, window_);
  }
  return std::span<const std::byte>(window_).subspan(offset - window_begin_, bytes);
}

void NanoBytes::fail(const std::string& detail) const { failData("{}: {}", name_, detail); }

}  // namespace blockwalk
