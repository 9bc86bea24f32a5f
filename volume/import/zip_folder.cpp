// SPDX-License-Identifier: Apache-2.0
#include "volume/import/zip_folder.h"

#include <stdlib.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/zip_file.h"
#include "volume/plain_file.h"

namespace blockwalk {
namespace {

// Removed with all that is in it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "blockwalk-zip-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw std::system_error(errno, std::generic_category(), name + ": no folder to unpack into");
    }
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// Of a source that reads files of the folder.
class UnpackedSource final : public Source {
 public:
  UnpackedSource(std::shared_ptr<const TemporaryFolder> folder, std::unique_ptr<Source> source, std::string name)
      : folder_(std::move(folder)), source_(std::move(source)), info_(source_->info()) {
    info_.name = std::move(name);
  }
  const SourceInfo& info() const override { return info_; }
  void readRows(int z, int y, int count, std::span<std::byte> out) override { source_->readRows(z, y, count, out); }
  std::unique_ptr<Source> another() const override {
    auto other = source_->another();
    if (!other) return nullptr;
    return std::make_unique<UnpackedSource>(folder_, std::move(other), info_.name);
  }
  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override { source_->findRuns(box, runs); }
  void readBox(const VoxelBox& box, std::span<std::byte> out) override { source_->readBox(box, out); }
  ConversionReport conversion(std::size_t channel) const override { return source_->conversion(channel); }

 private:
  std::shared_ptr<const TemporaryFolder> folder_;
  std::unique_ptr<Source> source_;
  SourceInfo info_;
};

// Programs of one system leave such beside the files of others.
bool isPassedOver(const std::filesystem::path& name) {
  for (const auto& part : name) {
    if (part == "__MACOSX" || part.string().starts_with('.')) return true;
  }
  return false;
}

std::filesystem::path checkedName(const std::string& name, const std::string& zip) {
  std::filesystem::path path(name);
  bool stays = !path.is_absolute() && !name.empty() && name.find('\0') == std::string::npos;
  for (const auto& part : path) stays = stays && part != "..";
  if (!stays) failData("{}: zip: an entry's name leads out of the folder", zip);
  return path;
}

void requireRoom(const ZipFile& zip, const std::filesystem::path& folder) {
  constexpr std::size_t kMostFiles = 200000;
  constexpr std::uint64_t kLeftFree = std::uint64_t{1} << 30;
  if (zip.entries().size() > kMostFiles) {
    failData("{}: zip: holds {} files, at most {} are read", zip.name(), zip.entries().size(), kMostFiles);
  }
  const std::uint64_t free = std::filesystem::space(folder).available;
  std::uint64_t left = free - std::min(free, kLeftFree);
  for (const auto& [name, entry] : zip.entries()) {
    if (entry.bytes > left) {
      failData("{}: zip: does not fit {}, which has {} bytes free: unpack it elsewhere, or set TMPDIR", zip.name(),
               folder.parent_path().string(), free);
    }
    left -= entry.bytes;
  }
}

void unpackAll(const ZipFile& zip, const std::filesystem::path& folder) {
  requireRoom(zip, folder);
  for (const auto& [name, entry] : zip.entries()) {
    const std::filesystem::path path = checkedName(name, zip.name());
    if (isPassedOver(path)) continue;
    const std::filesystem::path to = folder / path;
    std::filesystem::create_directories(to.parent_path());
    PlainFile file(to);
    zip.unpack(entry, fmt::format("{}: {}", zip.name(), path.string()),
               [&](std::span<const std::byte> piece) { file.write(piece); });
    file.close();
  }
}

// What is alone in a folder is what is meant.
std::filesystem::path whatIsMeant(std::filesystem::path path) {
  while (std::filesystem::is_directory(path)) {
    std::vector<std::filesystem::path> inside;
    for (const auto& entry : std::filesystem::directory_iterator(path)) inside.push_back(entry.path());
    if (inside.size() != 1) break;
    path = inside[0];
  }
  return path;
}

}  // namespace

bool isZarrZip(std::shared_ptr<const InputFile> file, std::uint64_t memory_bytes) {
  const ZipFile zip(std::move(file), memory_bytes / 64);
  if (zip.entries().empty()) return true;  // whoever reads it says so
  const std::string& first = zip.entries().begin()->first;
  for (const std::string& root : {std::string(), first.substr(0, first.find('/') + 1)}) {
    for (const char* name : {"zarr.json", ".zgroup", ".zarray", ".zattrs"}) {
      if (zip.entries().contains(root + name)) return true;
    }
  }
  return false;
}

std::unique_ptr<Source> openZipFolder(
    std::shared_ptr<const InputFile> file, std::uint64_t memory_bytes,
    const std::function<std::unique_ptr<Source>(const std::filesystem::path&)>& open) {
  const std::string name = file->name();
  const auto folder = std::make_shared<const TemporaryFolder>();
  unpackAll(ZipFile(std::move(file), memory_bytes / 64), folder->path());
  return std::make_unique<UnpackedSource>(folder, open(whatIsMeant(folder->path())), name);
}

}  // namespace blockwalk
