// SPDX-License-Identifier: Apache-2.0
#include "volume/export/output_folder.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <random>
#include <system_error>

#include "volume/build/storage.h"
#include "volume/error.h"

namespace blockwalk {
namespace {

[[noreturn]] void failSystem(int error, const std::filesystem::path& path, const char* action) {
  throw std::system_error(error, std::generic_category(), fmt::format("{}: {}", path.string(), action));
}

// Of those who were killed.
void removeLeftFolders(const std::filesystem::path& path) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folderOf(path), ignored)) {
    if (!isPartialName(entry.path().filename().string(), path)) continue;
    const int folder = ::open(entry.path().c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (folder < 0) continue;  // a partial file, or gone
    if (::flock(folder, LOCK_EX | LOCK_NB) == 0) std::filesystem::remove_all(entry.path(), ignored);
    ::close(folder);
  }
}

// The folder's descriptor with a lock, or -1 where somebody took it for one that was left.
int lockFolder(const std::filesystem::path& path) {
  const int folder = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return -1;
  ::flock(folder, LOCK_EX);  // file systems without locks have none to take it for theirs either
  struct stat status {};
  if (::fstat(folder, &status) == 0 && status.st_nlink > 0) return folder;
  ::close(folder);
  return -1;
}

}  // namespace

// "a/b/" is "a/b".
OutputFolder::OutputFolder(const std::filesystem::path& path) : path_(path.has_filename() ? path : path.parent_path()) {
  std::error_code absent;
  if (std::filesystem::exists(std::filesystem::symlink_status(path_, absent))) {
    failData("{}: is there already; a folder takes no other's place", path_.string());
  }
  removeLeftFolders(path_);
  std::random_device random;
  int made = -1;
  for (int attempt = 0; attempt < 100 && lock_ < 0; ++attempt) {
    partial_ = folderOf(path_) / partialName(path_, random());
    made = ::mkdir(partial_.c_str(), 0777);
    if (made == 0) lock_ = lockFolder(partial_);
    if (made != 0 && errno != EEXIST) break;
  }
  if (lock_ < 0) failSystem(errno, partial_, "cannot be created");
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  if (!partial_.empty()) std::filesystem::remove_all(partial_, ignored);
  if (lock_ >= 0) ::close(lock_);
}

void OutputFolder::commit() {
  // All that was written into it at once: its files need not be synced one by one.
  if (::syncfs(lock_) != 0) failSystem(errno, partial_, "cannot be written to the disk");
  // Whoever was faster keeps the name; file systems that cannot tell are asked the plain way.
  int renamed = ::renameat2(AT_FDCWD, partial_.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE);
  if (renamed != 0 && errno == EINVAL) renamed = ::rename(partial_.c_str(), path_.c_str());
  if (renamed != 0) failSystem(errno, path_, "the finished folder cannot get this name");
  partial_.clear();
}

}  // namespace blockwalk
