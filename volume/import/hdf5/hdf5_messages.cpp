// SPDX-License-Identifier: Apache-2.0
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <span>

#include "volume/import/hdf5/hdf5_reader.h"

namespace blockwalk {
namespace {

bool sendAll(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

bool receiveAll(int socket, std::span<char> out, int timeout_ms) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::milliseconds(timeout_ms);
  while (!out.empty()) {
    int left_ms = -1;
    if (timeout_ms >= 0) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
      if (left <= 0) return false;
      left_ms = static_cast<int>(left);
    }
    pollfd waits{.fd = socket, .events = POLLIN, .revents = 0};
    const int ready = poll(&waits, 1, left_ms);
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return false;
    const ssize_t got = recv(socket, out.data(), out.size(), 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    out = out.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

}  // namespace

bool sendHdf5Message(int socket, std::string_view bytes) {
  const std::uint64_t length = bytes.size();
  std::string head(sizeof length, '\0');
  std::memcpy(head.data(), &length, sizeof length);
  return sendAll(socket, head) && sendAll(socket, bytes);
}

std::optional<std::string> receiveHdf5Message(int socket, std::uint64_t most, int timeout_ms) {
  std::uint64_t length = 0;
  if (!receiveAll(socket, {reinterpret_cast<char*>(&length), sizeof length}, timeout_ms)) return std::nullopt;
  if (length > most) return std::nullopt;
  std::string bytes(length, '\0');
  if (!receiveAll(socket, bytes, timeout_ms)) return std::nullopt;
  return bytes;
}

}  // namespace blockwalk
