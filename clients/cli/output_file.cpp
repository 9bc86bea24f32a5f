// SPDX-License-Identifier: Apache-2.0
#include "clients/cli/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <string>
#include <system_error>

namespace blockwalk {

void writeOutputFile(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  // A device or a pipe is written to as it is: /dev/stdout cannot be renamed over.
  std::error_code absent;
  const bool in_place = std::filesystem::exists(path, absent) && !std::filesystem::is_regular_file(path, absent);
  const std::filesystem::path target =
      in_place ? path : std::filesystem::path(path.string() + ".part-" + std::to_string(getpid()));
  const auto fail = [&](const char* what) {
    const std::error_code code(errno, std::generic_category());
    if (!in_place) unlink(target.c_str());
    throw std::system_error(code, path.string() + ": " + what);
  };
  const int file = open(target.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0) fail("cannot be written");
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written = write(file, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      const int cause = errno;
      close(file);
      errno = cause;
      fail("writing failed");
    }
    done += static_cast<std::size_t>(written);
  }
  if (close(file) != 0) fail("writing failed");
  if (!in_place && rename(target.c_str(), path.c_str()) != 0) fail("cannot be renamed into place");
}

std::string outputSuffix(const std::filesystem::path& path) {
  std::string suffix = path.extension().string();
  std::ranges::transform(suffix, suffix.begin(), [](unsigned char c) { return std::tolower(c); });
  return suffix;
}

}  // namespace blockwalk
