// SPDX-License-Identifier: Apache-2.0
#include "server/base/small_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "server/base/options.h"

namespace blockwalk {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 20;

struct Descriptor {
  int number = -1;
  explicit Descriptor(const std::filesystem::path& path)
      : number(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)) {}
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
};

}  // namespace

std::string readSmallFile(std::string_view option, const std::filesystem::path& path) {
  const auto refuse = [&](std::string_view why) {
    throw UsageError(fmt::format("--{}: cannot read '{}': {}", option, path.string(), why));
  };
  const auto refuseForErrno = [&] { refuse(std::generic_category().message(errno)); };
  const Descriptor file(path);
  if (file.number < 0) refuseForErrno();
  struct stat status {};
  if (::fstat(file.number, &status) != 0) refuseForErrno();
  if (!S_ISREG(status.st_mode)) refuse(S_ISDIR(status.st_mode) ? "it is a folder" : "it is no regular file");
  std::string text(kMostBytes + 1, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const ssize_t count = ::read(file.number, text.data() + size, text.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) refuseForErrno();
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  if (size > kMostBytes) refuse(fmt::format("it has more than {} bytes", kMostBytes));
  text.resize(size);
  return text;
}

}  // namespace blockwalk
