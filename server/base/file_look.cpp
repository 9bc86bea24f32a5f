// SPDX-License-Identifier: Apache-2.0
#include "server/base/file_look.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <system_error>

namespace blockwalk {

FileLook lookAt(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) {
    const int error = errno;
    return {.missing = std::generic_category().message(error), .is_gone = error == ENOENT || error == ENOTDIR};
  }
  return {.identity = fmt::format("{}|{}|{}|{}|{}.{:09}", file.string(), status.st_dev, status.st_ino, status.st_size,
                                  status.st_mtim.tv_sec, status.st_mtim.tv_nsec)};
}

}  // namespace blockwalk
