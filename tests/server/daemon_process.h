// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace blockwalk {

constexpr const char* kDaemon = BLOCKWALK_BINARY_DIR "/blockwalkd";

// A running daemon whose output, both streams together, is read through a pipe. With a limit it has so many bytes of
// address space.
class DaemonProcess {
 public:
  explicit DaemonProcess(std::vector<std::string> arguments, std::uint64_t address_space_bytes = 0) {
    std::array<int, 2> pipe_ends{};
    EXPECT_EQ(pipe(pipe_ends.data()), 0);
    arguments.insert(arguments.begin(), kDaemon);
    std::vector<char*> pointers;
    pointers.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    id_ = fork();
    if (id_ == 0) {
      const rlimit limit{.rlim_cur = address_space_bytes, .rlim_max = address_space_bytes};
      if (address_space_bytes > 0 && setrlimit(RLIMIT_AS, &limit) != 0) _exit(126);
      dup2(pipe_ends[1], STDOUT_FILENO);
      dup2(pipe_ends[1], STDERR_FILENO);
      close(pipe_ends[0]);
      close(pipe_ends[1]);
      execv(kDaemon, pointers.data());
      _exit(127);
    }
    close(pipe_ends[1]);
    output_ = pipe_ends[0];
  }
  ~DaemonProcess() {
    if (id_ > 0) {
      kill(id_, SIGKILL);
      waitpid(id_, nullptr, 0);
    }
    close(output_);
  }
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  void signal(int number) { kill(id_, number); }

  // Until `text` is in the output; false when the program ends without it.
  bool readUntil(const std::string& text) {
    std::array<char, 4096> bytes{};
    while (seen_.find(text) == std::string::npos) {
      const ssize_t count = ::read(output_, bytes.data(), bytes.size());
      if (count <= 0) return false;
      seen_.append(bytes.data(), static_cast<std::size_t>(count));
    }
    return true;
  }

  int wait() {
    readUntil("\xff never");
    int status = 0;
    waitpid(id_, &status, 0);
    id_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  bool isAlive() {
    if (id_ <= 0 || waitpid(id_, &status_, WNOHANG) == 0) return id_ > 0;
    id_ = -1;
    return false;
  }
  // As waitpid() gives it, once isAlive() was false.
  int status() const { return status_; }

  // 0 where it ended without listening.
  std::uint16_t port() {
    if (!readUntil("listening on http://127.0.0.1:") || !readUntil("/\n")) return 0;
    const std::size_t at = seen_.find("listening on http://127.0.0.1:") + 30;
    return static_cast<std::uint16_t>(std::stoi(seen_.substr(at)));
  }

  const std::string& seen() const { return seen_; }

 private:
  pid_t id_ = -1;
  int output_ = -1;
  int status_ = 0;
  std::string seen_;
};

}  // namespace blockwalk
