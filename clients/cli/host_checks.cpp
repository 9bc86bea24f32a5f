// SPDX-License-Identifier: Apache-2.0
#include "clients/cli/host_checks.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string_view>
#include <system_error>

#include "volume/host_limits.h"

namespace blockwalk {
namespace {

using Kind = Finding::Kind;

constexpr std::uint64_t kWantedFiles = 1024;  // 512 connections and as much again
constexpr std::uint64_t kLeastMemory = std::uint64_t{1} << 30;

std::string reasonOf(int error) { return std::generic_category().message(error); }

class Socket {
 public:
  Socket() : number_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (number_ >= 0) close(number_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

sockaddr_in addressAt(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// Asks what a Blockwalk server answers at once.
template <typename Send, typename Receive>
bool answersAlive(int port, Send send, Receive receive) {
  const std::string ask = fmt::format("GET /livez HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nConnection: close\r\n\r\n", port);
  if (!send(ask)) return false;
  std::array<char, 4096> reply{};
  std::size_t length = 0;
  while (length < reply.size()) {
    const auto count = receive(reply.data() + length, reply.size() - length);
    if (count <= 0) break;
    length += static_cast<std::size_t>(count);
  }
  return std::string_view(reply.data(), length).find(R"({"alive":true})") != std::string_view::npos;
}

enum class Speech { plain, tls };

// Whether what listens there answers as a Blockwalk server does, each step within a second. Whose certificate it has
// says nothing of that, and is not asked.
bool isBlockwalk(const sockaddr* address, socklen_t size, int port, Speech speech) {
  const Socket socket;
  const timeval second{.tv_sec = 1, .tv_usec = 0};
  setsockopt(socket.number(), SOL_SOCKET, SO_RCVTIMEO, &second, sizeof second);
  setsockopt(socket.number(), SOL_SOCKET, SO_SNDTIMEO, &second, sizeof second);
  if (connect(socket.number(), address, size) != 0) return false;
  if (speech == Speech::plain) {
    const auto sendAll = [&](const std::string& text) {
      return send(socket.number(), text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
    };
    return answersAlive(port, sendAll,
                        [&](char* to, std::size_t bytes) { return recv(socket.number(), to, bytes, 0); });
  }
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_client_method()), SSL_CTX_free);
  const std::unique_ptr<SSL, decltype(&SSL_free)> tls(SSL_new(context.get()), SSL_free);
  if (SSL_set_fd(tls.get(), socket.number()) != 1 || SSL_connect(tls.get()) != 1) return false;
  const auto sendAll = [&](const std::string& text) {
    return SSL_write(tls.get(), text.data(), static_cast<int>(text.size())) == static_cast<int>(text.size());
  };
  return answersAlive(port, sendAll,
                      [&](char* to, std::size_t bytes) { return SSL_read(tls.get(), to, static_cast<int>(bytes)); });
}

}  // namespace

Finding checkOpenFiles() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return {Kind::note, "open files", reasonOf(errno)};
  if (limit.rlim_cur == RLIM_INFINITY) return {Kind::good, "open files", "without limit"};
  const std::uint64_t most = limit.rlim_cur;
  Finding finding{Kind::good, "open files", fmt::format("at most {}", most)};
  if (most >= kWantedFiles) return finding;
  finding.kind = Kind::wrong;
  finding.advice =
      fmt::format("ulimit -n {} in the shell, LimitNOFILE={} in a systemd unit; or blockwalkd --max-connections {}",
                  kWantedFiles, kWantedFiles, most > 64 ? (most - 64) / 2 : 1);
  return finding;
}

Finding checkHostMemory() {
  const std::uint64_t free = freeHostBytes();
  Finding finding{Kind::good, "memory", fmt::format("{:.1f} GiB free", static_cast<double>(free) / (1 << 30))};
  if (free >= kLeastMemory) return finding;
  finding.kind = Kind::wrong;
  finding.advice =
      "a software device keeps volumes in it: end what is not needed, raise the control group's memory.max, "
      "or give blockwalkd a --memory-budget below it";
  return finding;
}

std::filesystem::path temporaryFolder() {
  std::error_code absent;  // what it names then is told by who writes there
  const std::filesystem::path folder = std::filesystem::temp_directory_path(absent);
  if (!absent) return folder;
  for (const char* name : {"TMPDIR", "TMP", "TEMP", "TEMPDIR"}) {
    if (const char* named = std::getenv(name)) return named;
  }
  return "/tmp";
}

Finding checkFolder(const std::string& name, const std::filesystem::path& folder) {
  std::string path = (folder / ".blockwalk-XXXXXX").string();
  const int file = mkstemp(path.data());
  if (file < 0) {
    const int error = errno;
    return {Kind::wrong, name, fmt::format("{} cannot be written to: {}", folder.string(), reasonOf(error)),
            "chown or chmod it, or choose another; a full disk needs room"};
  }
  const bool is_written = write(file, "x", 1) == 1;
  const int error = errno;
  close(file);
  unlink(path.c_str());
  if (is_written) return {Kind::good, name, fmt::format("{} can be written to", folder.string())};
  return {Kind::wrong, name, fmt::format("nothing can be written in {}: {}", folder.string(), reasonOf(error)),
          "make room on its disk"};
}

Finding checkPage() {
  std::error_code failure;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", failure);
  for (const char* below : {"share/blockwalk/web", "../share/blockwalk/web"}) {
    const std::filesystem::path folder = (program.parent_path() / below).lexically_normal();
    if (std::filesystem::exists(folder / "index.html", failure)) return {Kind::good, "page", folder.string()};
  }
  return {Kind::note, "page", "is not beside this program",
          "pictures and numbers are served without it; build with npm installed, or name a --web-root"};
}

Finding checkPort(int port) {
  const std::string name = fmt::format("port {}", port);
  const Socket socket;
  const int reuse = 1;
  setsockopt(socket.number(), SOL_SOCKET, SO_REUSEADDR, &reuse, sizeof reuse);
  const sockaddr_in place = addressAt(port);
  const auto* address = reinterpret_cast<const sockaddr*>(&place);
  if (bind(socket.number(), address, sizeof place) == 0 && listen(socket.number(), 1) == 0) {
    return {Kind::good, name, "free on 127.0.0.1"};
  }
  const int error = errno;
  if (error == EADDRINUSE) {
    if (isBlockwalk(address, sizeof place, port, Speech::plain)) {
      return {Kind::good, name, "a Blockwalk server answers there"};
    }
    if (isBlockwalk(address, sizeof place, port, Speech::tls)) {
      return {Kind::good, name, "a Blockwalk server answers there, with TLS"};
    }
  }
  return {Kind::wrong, name, fmt::format("cannot be listened at: {}", reasonOf(error)),
          error == EACCES ? "ports below 1024 need rights: blockwalkd --listen 127.0.0.1:8080"
                          : "end what listens there, or blockwalkd --listen 127.0.0.1:ANOTHER"};
}

}  // namespace blockwalk
