// SPDX-License-Identifier: Apache-2.0
// A Zarr hierarchy in one zip file: stored entries are read in place, deflated ones whole.
#include <algorithm>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/input_file.h"
#include "volume/import/zarr/zarr_store.h"
#include "volume/import/zip_file.h"

namespace blockwalk {
namespace {

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

class ZipStore final : public ZarrStore {
 public:
  ZipStore(const std::filesystem::path& path, std::uint64_t most_bytes)
      : zip_(std::make_shared<InputFile>(path), most_bytes / 16), most_bytes_(most_bytes) {
    findRoot();
  }

  const std::string& name() const override { return zip_.name(); }

  std::shared_ptr<const ZarrObject> open(const std::string& key) const override {
    const auto found = zip_.entries().find(root_ + key);
    if (found == zip_.entries().end()) return nullptr;
    const ZipEntry& entry = found->second;
    const std::string named = fmt::format("{}: {}", name(), key);
    if (entry.method != 0) return std::make_shared<UnpackedEntry>(zip_.unpack(entry, named, most_bytes_), named);
    return std::make_shared<StoredEntry>(zip_.file(), zip_.begin(entry, named), entry.packed_bytes, named);
  }

  void list(const std::string& key, const std::function<bool(std::string_view)>& visit) const override {
    const auto& entries = zip_.entries();
    const std::string below = root_ + (key.empty() ? "" : key + "/");
    for (auto at = entries.lower_bound(below); at != entries.end() && at->first.starts_with(below);) {
      const std::string_view rest = std::string_view(at->first).substr(below.size());
      const std::string name(rest.substr(0, rest.find('/')));
      if (!name.empty() && !visit(name)) return;
      // Past all that lies below it.
      at = name.size() == rest.size() ? std::next(at) : entries.lower_bound(below + name + static_cast<char>('/' + 1));
    }
  }

 private:
  // The hierarchy may lie in the file's only folder.
  void findRoot() {
    const auto has = [&](const char* name) { return zip_.entries().contains(root_ + name); };
    const auto is_root = [&] { return has("zarr.json") || has(".zgroup") || has(".zarray") || has(".zattrs"); };
    if (is_root() || zip_.entries().empty()) return;
    const std::string& first = zip_.entries().begin()->first;
    root_ = first.substr(0, first.find('/') + 1);
    if (!is_root()) failData("{}: is a zip file without zarr.json, .zgroup or .zarray", name());
  }

  ZipFile zip_;
  std::uint64_t most_bytes_;
  std::string root_;  // "" or "folder/"
};

}  // namespace

std::unique_ptr<ZarrStore> openZarrZip(const std::filesystem::path& file, std::uint64_t most_bytes) {
  return std::make_unique<ZipStore>(file, most_bytes);
}

}  // namespace blockwalk
