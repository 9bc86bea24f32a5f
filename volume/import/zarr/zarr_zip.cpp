// SPDX-License-Identifier: Apache-2.0
// A Zarr hierarchy in one zip file (APPNOTE.TXT, with zip64): stored entries are read in place, deflated ones whole.
#include <zlib.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/input_file.h"
#include "volume/import/zarr/zarr_codec.h"
#include "volume/import/zarr/zarr_store.h"

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

struct ZipEntry {
  std::uint64_t header = 0;  // offset of the local header
  std::uint64_t packed_bytes = 0;
  std::uint64_t bytes = 0;
  int method = 0;
};

class StoredEntry final : public ZarrObject {
 public:
  StoredEntry(std::shared_ptr<const InputFile> file, std::uint64_t begin, std::uint64_t bytes, std::string name)
      : file_(std::move(file)), begin_(begin), bytes_(bytes), name_(std::move(name)) {}
  std::uint64_t bytes() const override { return bytes_; }
  void read(std::uint64_t offset, std::span<std::byte> out) const override {
    if (offset > bytes_ || out.size() > bytes_ - offset) {
      failData("{}: has {} bytes, byte {} was asked for", name_, bytes_, offset + out.size());
    }
    file_->read(begin_ + offset, out);
  }

 private:
  std::shared_ptr<const InputFile> file_;
  std::uint64_t begin_;
  std::uint64_t bytes_;
  std::string name_;
};

class UnpackedEntry final : public ZarrObject {
 public:
  UnpackedEntry(std::vector<std::byte> all, std::string name) : all_(std::move(all)), name_(std::move(name)) {}
  std::uint64_t bytes() const override { return all_.size(); }
  void read(std::uint64_t offset, std::span<std::byte> out) const override {
    if (offset > all_.size() || out.size() > all_.size() - offset) {
      failData("{}: has {} bytes, byte {} was asked for", name_, all_.size(), offset + out.size());
    }
    std::copy_n(all_.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
  }

 private:
  std::vector<std::byte> all_;
  std::string name_;
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
      failData("{}: zip directory: has {} bytes, must be at most {}, a 64th of --memory", file_.name(), bytes_,
               most_bytes_);
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

class ZipStore final : public ZarrStore {
 public:
  ZipStore(const std::filesystem::path& path, std::uint64_t most_bytes)
      : file_(std::make_shared<InputFile>(path)),
        most_bytes_(most_bytes),
        entries_(ZipDirectory(*file_, most_bytes / 16).read()) {
    findRoot();
  }

  const std::string& name() const override { return file_->name(); }

  std::shared_ptr<const ZarrObject> open(const std::string& key) const override {
    const auto found = entries_.find(root_ + key);
    if (found == entries_.end()) return nullptr;
    const ZipEntry& entry = found->second;
    const std::string named = fmt::format("{}: {}", name(), key);
    if (entry.method != 0 && entry.method != Z_DEFLATED) {
      failData("{}: zip method {} cannot be read; stored and deflated can", named, entry.method);
    }
    std::vector<std::byte> local(kLocalBytes);
    file_->read(entry.header, local);
    const LittleEndian header{local};
    if (header.word(0) != 0x04034b50) failData("{}: zip: no entry at byte {}", named, entry.header);
    const std::uint64_t begin = entry.header + kLocalBytes + header.half(26) + header.half(28);
    if (begin > file_->bytes() || entry.packed_bytes > file_->bytes() - begin) {
      failData("{}: zip: {} bytes from byte {} are declared, the file has {}", named, entry.packed_bytes, begin,
               file_->bytes());
    }
    if (entry.method == 0) return std::make_shared<StoredEntry>(file_, begin, entry.packed_bytes, named);
    return std::make_shared<UnpackedEntry>(unpack(entry, begin, named), named);
  }

  void list(const std::string& key, const std::function<bool(std::string_view)>& visit) const override {
    const std::string below = root_ + (key.empty() ? "" : key + "/");
    for (auto at = entries_.lower_bound(below); at != entries_.end() && at->first.starts_with(below);) {
      const std::string_view rest = std::string_view(at->first).substr(below.size());
      const std::string name(rest.substr(0, rest.find('/')));
      if (!name.empty() && !visit(name)) return;
      // Past all that lies below it.
      at = name.size() == rest.size() ? std::next(at) : entries_.lower_bound(below + name + static_cast<char>('/' + 1));
    }
  }

 private:
  std::vector<std::byte> unpack(const ZipEntry& entry, std::uint64_t begin, const std::string& named) const {
    if (std::max(entry.bytes, entry.packed_bytes) > most_bytes_) {
      failData("{}: zip: has {} bytes, packed ones may have {}, a sixteenth of --memory", named, entry.bytes,
               most_bytes_);
    }
    std::vector<std::byte> packed(entry.packed_bytes);
    file_->read(begin, packed);
    std::vector<std::byte> out(entry.bytes);
    if (unpackDeflate(packed, out, -MAX_WBITS) != entry.bytes) {
      failData("{}: zip: {} bytes do not unpack to {}", named, packed.size(), entry.bytes);
    }
    return out;
  }

  // The hierarchy may lie in the file's only folder.
  void findRoot() {
    const auto has = [&](const char* name) { return entries_.contains(root_ + name); };
    const auto is_root = [&] { return has("zarr.json") || has(".zgroup") || has(".zarray") || has(".zattrs"); };
    if (is_root() || entries_.empty()) return;
    const std::string& first = entries_.begin()->first;
    root_ = first.substr(0, first.find('/') + 1);
    if (!is_root()) failData("{}: is a zip file without zarr.json, .zgroup or .zarray", name());
  }

  std::shared_ptr<const InputFile> file_;
  std::uint64_t most_bytes_;
  std::map<std::string, ZipEntry> entries_;
  std::string root_;  // "" or "folder/"
};

}  // namespace

std::unique_ptr<ZarrStore> openZarrZip(const std::filesystem::path& file, std::uint64_t most_bytes) {
  return std::make_unique<ZipStore>(file, most_bytes);
}

}  // namespace blockwalk
