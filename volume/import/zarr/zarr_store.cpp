// SPDX-License-Identifier: Apache-2.0
#include "volume/import/zarr/zarr_store.h"

#include <system_error>
#include <utility>

#include "volume/error.h"
#include "volume/import/input_file.h"

namespace blockwalk {
namespace {

constexpr std::size_t kMaxPathBytes = 1024;

class FileObject final : public ZarrObject {
 public:
  explicit FileObject(const std::filesystem::path& path) : file_(path) {}
  std::uint64_t bytes() const override { return file_.bytes(); }
  void read(std::uint64_t offset, std::span<std::byte> out) const override { file_.read(offset, out); }

 private:
  InputFile file_;
};

class FolderStore final : public ZarrStore {
 public:
  explicit FolderStore(const std::filesystem::path& folder)
      : folder_(std::filesystem::absolute(folder / "").parent_path()), name_(folder_.filename().string()) {}

  const std::string& name() const override { return name_; }

  std::shared_ptr<const ZarrObject> open(const std::string& key) const override {
    const auto path = folder_ / key;
    std::error_code absent;
    if (!std::filesystem::exists(path, absent)) return nullptr;
    return std::make_shared<FileObject>(path);
  }

  void list(const std::string& key, const std::function<bool(std::string_view)>& visit) const override {
    std::error_code error;
    for (std::filesystem::directory_iterator at(folder_ / key, error), end; !error && at != end; at.increment(error)) {
      if (!visit(at->path().filename().string())) return;
    }
  }

 private:
  std::filesystem::path folder_;
  std::string name_;
};

}  // namespace

std::unique_ptr<ZarrStore> openZarrFolder(const std::filesystem::path& folder) {
  return std::make_unique<FolderStore>(folder);
}

std::string joinKeys(const std::string& key, std::string_view name) {
  if (key.empty()) return std::string(name);
  return name.empty() ? key : fmt::format("{}/{}", key, name);
}

std::string keyBelow(const std::string& key, std::string_view path, const std::string& file, const std::string& field) {
  if (path.size() > kMaxPathBytes) {
    failData("{}: {} has {} bytes, must be at most {}", file, field, path.size(), kMaxPathBytes);
  }
  std::string result = key;
  while (!path.empty()) {
    const std::string_view name = path.substr(0, path.find('/'));
    path.remove_prefix(std::min(name.size() + 1, path.size()));
    if (name.empty() || name == ".") continue;
    if (name == ".." || name.find('\0') != std::string_view::npos) {
      failData("{}: {} '{}' must stay inside the folder", file, field, name);
    }
    result = joinKeys(result, name);
  }
  return result;
}

}  // namespace blockwalk
