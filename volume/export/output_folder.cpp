// SPDX-License-Identifier: Apache-2.0
#include "volume/export/output_folder.h"

#include <fcntl.h>
#include <stdio.h>
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

}  // namespace

// "a/b/" is "a/b".
OutputFolder::OutputFolder(const std::filesystem::path& path) : path_(path.has_filename() ? path : path.parent_path()) {
  std::error_code absent;
  if (std::filesystem::exists(std::filesystem::symlink_status(path_, absent))) {
    failData("{}: is there already; a folder takes no other's place", path_.string());
  }
  std::random_device random;
  int made = -1;
  for (int attempt = 0; attempt < 100 && made != 0; ++attempt) {
    partial_ = folderOf(path_) / fmt::format(".{}.partial-{:08x}", path_.filename().string(), random());
    made = ::mkdir(partial_.c_str(), 0777);
    if (made != 0 && errno != EEXIST) break;
  }
  if (made != 0) failSystem(errno, partial_, "cannot be created");
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  if (!partial_.empty()) std::filesystem::remove_all(partial_, ignored);
}

void OutputFolder::commit() {
  // All that was written into it at once: its files need not be synced one by one.
  const int inside = ::open(partial_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (inside < 0) failSystem(errno, partial_, "cannot be opened");
  const int synced = ::syncfs(inside);
  const int error = errno;
  ::close(inside);
  if (synced != 0) failSystem(error, partial_, "cannot be written to the disk");
  // Whoever was faster keeps the name; file systems that cannot tell are asked the plain way.
  int renamed = ::renameat2(AT_FDCWD, partial_.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE);
  if (renamed != 0 && errno == EINVAL) renamed = ::rename(partial_.c_str(), path_.c_str());
  if (renamed != 0) failSystem(errno, path_, "the finished folder cannot get this name");
  partial_.clear();
}

}  // namespace blockwalk
