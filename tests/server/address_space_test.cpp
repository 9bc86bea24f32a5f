// SPDX-License-Identifier: Apache-2.0
// The daemon in an address space that is too small for what it is asked: it draws or refuses, and goes on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>

#include "running_server.h"

namespace blockwalk {
namespace {

const char* const kDaemon = BLOCKWALK_BINARY_DIR "/blockwalkd";

// The program with so many bytes of address space, and what it says until it listens.
class Confined {
 public:
  Confined(std::uint64_t bytes, std::vector<std::string> arguments) {
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe(ends.data()), 0);
    arguments.insert(arguments.begin(), kDaemon);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    id_ = fork();
    if (id_ == 0) {
      const rlimit limit{.rlim_cur = bytes, .rlim_max = bytes};
      if (setrlimit(RLIMIT_AS, &limit) != 0) _exit(126);
      dup2(ends[1], STDOUT_FILENO);
      dup2(ends[1], STDERR_FILENO);
      execv(kDaemon, pointers.data());
      _exit(127);
    }
    close(ends[1]);
    output_ = ends[0];
  }
  ~Confined() {
    if (id_ > 0) {
      kill(id_, SIGKILL);
      waitpid(id_, nullptr, 0);
    }
    close(output_);
  }
  Confined(const Confined&) = delete;
  Confined& operator=(const Confined&) = delete;

  // 0 where it ended without listening.
  std::uint16_t port() {
    const std::string words = "listening on http://127.0.0.1:";
    std::array<char, 4096> bytes{};
    for (std::size_t at = 0;
         (at = seen_.find(words)) == std::string::npos || seen_.find("/\n", at) == std::string::npos;) {
      const ssize_t count = read(output_, bytes.data(), bytes.size());
      if (count <= 0) return 0;
      seen_.append(bytes.data(), static_cast<std::size_t>(count));
    }
    return static_cast<std::uint16_t>(std::stoi(seen_.substr(seen_.find(words) + words.size())));
  }
  bool isAlive() {
    if (id_ <= 0 || waitpid(id_, &status_, WNOHANG) == 0) return id_ > 0;
    id_ = -1;
    return false;
  }
  const std::string& seen() const { return seen_; }
  int status() const { return status_; }

 private:
  pid_t id_ = -1;
  int output_ = -1;
  int status_ = 0;
  std::string seen_;
};

constexpr const char* kViews[] = {"size=64x64",
                                  "size=2048x2048",
                                  "size=2048x2048&filter=linear&lit=on",
                                  "size=2048x2048&mode=mip&samples=2",
                                  "size=1024x1024&finder=octree&mode=iso&filter=linear",
                                  "size=1024x1024&finder=clusters",
                                  "size=4096x4096&format=raw&mode=first-hit"};

class AddressSpace : public testing::TestWithParam<int> {};

TEST_P(AddressSpace, DrawsOrRefusesAndGoesOn) {
  const std::uint64_t bytes = static_cast<std::uint64_t>(GetParam()) << 20;
  Confined daemon(bytes, {"--listen", "127.0.0.1:0", sampleVolume("rock").string()});
  const std::uint16_t port = daemon.port();
  ASSERT_NE(port, 0) << daemon.seen();
  ASSERT_TRUE(eventually([&] { return !daemon.isAlive() || get(port, "/readyz").status == 200; }));
  int drawn = 0;
  for (const char* view : kViews) {
    const auto reply = get(port, std::string("/api/v1/volumes/rock/image?") + view);
    EXPECT_TRUE(reply.status == 200 || reply.status == 503)
        << view << ": " << reply.status << " " << reply.body.substr(0, 300);
    if (reply.status == 503) {
      EXPECT_THAT(reply.body, testing::HasSubstr("free")) << view;
    }
    drawn += reply.status == 200 ? 1 : 0;
    ASSERT_TRUE(daemon.isAlive()) << view << ": ended with " << daemon.status() << "\n" << daemon.seen();
  }
  EXPECT_EQ(get(port, "/healthz").status, 200);
  EXPECT_GE(drawn, GetParam() >= 1536 ? 4 : 0);
}

INSTANTIATE_TEST_SUITE_P(Mebibytes, AddressSpace, testing::Values(700, 850, 1024, 1536, 2048));

}  // namespace
}  // namespace blockwalk
