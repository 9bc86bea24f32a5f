// SPDX-License-Identifier: Apache-2.0
#include "volume/import/zip_file.h"

#include <zlib.h>

#include <algorithm>
#include <utility>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::size_t kEndBytes = 22;
constexpr std::size_t kLocatorBytes = 20;
constexpr std::size_t kEnd64Bytes = 56;
constexpr std::size_t kEntryBytes = 46;
constexpr std::size_t kLocalBytes = 30;
constexpr std::uint32_t kIn64 = 0xffffffff;  // the number is in the 64-bit field

class LittleEndian {
 public:
  explicit LittleEndian(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::size_t size() const { return bytes_.size(); }
  std::uint64_t number(std::size_t at, std::size_t width) const {
    std::uint64_t value = 0;
    for (std::size_t i = width; i-- > 0;) value = value << 8 | std::to_integer<std::uint64_t>(bytes_[at + i]);
    return value;
  }
  std::uint32_t word(std::size_t at) const { return static_cast<std::uint32_t>(number(at, 4)); }
  std::uint16_t half(std::size_t at) const { return static_cast<std::uint16_t>(number(at, 2)); }
  std::string text(std::size_t at, std::size_t bytes) const {
    return {reinterpret_cast<const char*>(bytes_.data()) + at, bytes};
  }
  LittleEndian part(std::size_t at, std::size_t bytes) const { return LittleEndian(bytes_.subspan(at, bytes)); }

 private:
  std::span<const std::byte> bytes_;
};

// Reads the directory at the end of the file.
class ZipDirectory {
 public:
  ZipDirectory(const InputFile& file, std::uint64_t most_bytes) : file_(file), most_bytes_(most_bytes) {}

  std::map<std::string, ZipEntry> read() {
    findDirectory();
    if (begin_ > file_.bytes() || bytes_ > file_.bytes() - begin_) {
      failData("{}: zip directory: {} bytes from byte {} are declared, the file has {}", file_.name(), bytes_, begin_,
               file_.bytes());
    }
    if (bytes_ > most_bytes_) {
      failData("{}: zip directory: has {} bytes, must be at most {}", file_.name(), bytes_, most_bytes_);
    }
    std::vector<std::byte> all(bytes_);
    file_.read(begin_, all);
    std::map<std::string, ZipEntry> entries;
    const LittleEndian directory{all};
    for (std::size_t at = 0; at < all.size();) {
      if (all.size() - at < kEntryBytes || directory.word(at) != 0x02014b50) fail(at);
      const std::size_t name = directory.half(at + 28);
      const std::size_t extra = directory.half(at + 30);
      const std::size_t whole = kEntryBytes + name + extra + directory.half(at + 32);
      if (all.size() - at < whole) fail(at);
      takeEntry(directory.part(at, whole), directory.part(at + kEntryBytes + name, extra), entries);
      at += whole;
    }
    return entries;
  }

 private:
  [[noreturn]] void fail(std::size_t at) const {
    failData("{}: zip directory: no entry at its byte {}", file_.name(), at);
  }

  // The end record is the last thing but for a comment of up to 64 KiB.
  void findDirectory() {
    const std::uint64_t looked_at = std::min<std::uint64_t>(file_.bytes(), kEndBytes + 0xffff + kLocatorBytes);
    std::vector<std::byte> all(looked_at);
    file_.read(file_.bytes() - looked_at, all);
    const LittleEndian tail{all};
    for (std::size_t at = all.size() < kEndBytes ? 0 : all.size() - kEndBytes + 1; at-- > 0;) {
      if (tail.word(at) != 0x06054b50) continue;
      bytes_ = tail.word(at + 12);
      begin_ = tail.word(at + 16);
      if ((bytes_ == kIn64 || begin_ == kIn64) && at >= kLocatorBytes)
        find64(tail.part(at - kLocatorBytes, kLocatorBytes));
      return;
    }
    failData("{}: zip: has no directory at its end", file_.name());
  }

  void find64(const LittleEndian& locator) {
    if (locator.word(0) != 0x07064b50) failData("{}: zip64: the locator is missing", file_.name());
    std::vector<std::byte> all(kEnd64Bytes);
    file_.read(locator.number(8, 8), all);
    const LittleEndian end{all};
    if (end.word(0) != 0x06064b50) failData("{}: zip64: the end record is missing", file_.name());
    bytes_ = end.number(40, 8);
    begin_ = end.number(48, 8);
  }

  void takeEntry(const LittleEndian& entry, const LittleEndian& extra, std::map<std::string, ZipEntry>& entries) const {
    std::string name = entry.text(kEntryBytes, entry.half(28));
    if (name.ends_with('/')) return;
    ZipEntry found{
        .header = entry.word(42), .packed_bytes = entry.word(20), .bytes = entry.word(24), .method = entry.half(10)};
    read64(extra, found);
    if ((entry.half(8) & 1) != 0) found.method = -1;  // encrypted
    entries[std::move(name)] = found;
  }

  // What does not fit 32 bits, in this order.
  static void read64(const LittleEndian& extra, ZipEntry& entry) {
    for (std::size_t at = 0; at + 4 <= extra.size();) {
      const std::size_t bytes = std::min<std::size_t>(extra.half(at + 2), extra.size() - at - 4);
      if (extra.half(at) == 1) {
        std::size_t next = at + 4;
        for (std::uint64_t* field : {&entry.bytes, &entry.packed_bytes, &entry.header}) {
          if (*field != kIn64 || next + 8 > at + 4 + bytes) continue;
          *field = extra.number(next, 8);
          next += 8;
        }
      }
      at += 4 + bytes;
    }
  }

  const InputFile& file_;
  std::uint64_t most_bytes_;
  std::uint64_t begin_ = 0;
  std::uint64_t bytes_ = 0;
};

// Ends zlib's stream however its use does.
struct Inflater {
  Inflater() {
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
  }
  ~Inflater() { inflateEnd(&stream); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  z_stream stream{};
};

}  // namespace

ZipFile::ZipFile(std::shared_ptr<const InputFile> file, std::uint64_t most_directory_bytes)
    : file_(std::move(file)), entries_(ZipDirectory(*file_, most_directory_bytes).read()) {}

std::uint64_t ZipFile::begin(const ZipEntry& entry, const std::string& named) const {
  if (entry.method != 0 && entry.method != Z_DEFLATED) {
    const std::string method = entry.method < 0    ? "is encrypted"
                               : entry.method == 9 ? "is packed with Deflate64"
                                                   : fmt::format("is packed with method {}", entry.method);
    failData("{}: zip: {}; stored and deflated entries can be read: unzip {} -d FOLDER (or 7z x), and import FOLDER",
             named, method, name());
  }
  std::vector<std::byte> local(kLocalBytes);
  file_->read(entry.header, local);
  const LittleEndian header{local};
  if (header.word(0) != 0x04034b50) failData("{}: zip: no entry at byte {}", named, entry.header);
  const std::uint64_t at = entry.header + kLocalBytes + header.half(26) + header.half(28);
  if (at > file_->bytes() || entry.packed_bytes > file_->bytes() - at) {
    failData("{}: zip: {} bytes from byte {} are declared, the file has {}", named, entry.packed_bytes, at,
             file_->bytes());
  }
  return at;
}

std::vector<std::byte> ZipFile::unpack(const ZipEntry& entry, const std::string& named,
                                       std::uint64_t most_bytes) const {
  if (std::max(entry.bytes, entry.packed_bytes) > most_bytes) {
    failData("{}: zip: has {} bytes, packed ones may have {}, a sixteenth of --memory", named, entry.bytes, most_bytes);
  }
  std::vector<std::byte> out;
  out.reserve(entry.bytes);
  unpack(entry, named, [&](std::span<const std::byte> piece) { out.insert(out.end(), piece.begin(), piece.end()); });
  return out;
}

void ZipFile::unpack(const ZipEntry& entry, const std::string& named,
                     const std::function<void(std::span<const std::byte>)>& write) const {
  constexpr std::uint64_t kPiece = 1 << 16;
  const std::uint64_t from = begin(entry, named);
  const bool is_packed = entry.method != 0;
  Inflater inflater;
  std::vector<std::byte> packed(kPiece);
  std::vector<std::byte> piece(kPiece);
  std::uint64_t written = 0;
  int result = Z_OK;
  const auto put = [&](std::span<const std::byte> bytes) {
    written += bytes.size();
    if (written > entry.bytes) failData("{}: zip: unpacks to more than the {} bytes it declares", named, entry.bytes);
    if (!bytes.empty()) write(bytes);
  };
  for (std::uint64_t read = 0; read < entry.packed_bytes && result == Z_OK;) {
    const auto count = static_cast<std::size_t>(std::min(kPiece, entry.packed_bytes - read));
    file_->read(from + read, std::span(packed).first(count));
    read += count;
    if (!is_packed) {
      put(std::span(packed).first(count));
      continue;
    }
    inflater.stream.next_in = reinterpret_cast<Bytef*>(packed.data());
    inflater.stream.avail_in = static_cast<uInt>(count);
    do {
      inflater.stream.next_out = reinterpret_cast<Bytef*>(piece.data());
      inflater.stream.avail_out = static_cast<uInt>(piece.size());
      result = inflate(&inflater.stream, Z_NO_FLUSH);
      put(std::span(piece).first(piece.size() - inflater.stream.avail_out));
    } while (result == Z_OK && inflater.stream.avail_out == 0);
    if (result == Z_BUF_ERROR) result = Z_OK;  // it wants more
  }
  if ((is_packed && result != Z_STREAM_END) || written != entry.bytes) {
    failData("{}: zip: {} bytes do not unpack to {}", named, entry.packed_bytes, entry.bytes);
  }
}

}  // namespace blockwalk
