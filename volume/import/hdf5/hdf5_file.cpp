// SPDX-License-Identifier: Apache-2.0
#include "volume/import/hdf5/hdf5_file.h"

#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <functional>
#include <numeric>
#include <utility>

#include "volume/error.h"
#include "volume/import/child_bounds.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kMostAnswerBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kChunksAtATime = 65536;
constexpr int kTimeout_ms = 60000;

[[noreturn]] void serveAndExit(int socket, const InputFile& file, pid_t parent, std::uint64_t most_bytes) {
  boundChild(parent, most_bytes);
  try {
    serveHdf5(socket, file);
  } catch (...) {
    _exit(1);
  }
  _exit(0);
}

std::string withoutSlash(const std::string& path) {
  const std::size_t begin = std::min(path.find_first_not_of('/'), path.size());
  const std::size_t end = path.find_last_not_of('/') + 1;
  return begin < end ? path.substr(begin, end - begin) : std::string();
}

}  // namespace

Hdf5File::Hdf5File(std::shared_ptr<const InputFile> file, std::uint64_t memory_bytes) : file_(std::move(file)) {
  if (!canReadHdf5()) {
    failData("{}: is HDF5, which this program was built without: install libhdf5-dev and build it again", name());
  }
  constexpr std::uint64_t kLibraryBytes = std::uint64_t{64} << 20;
  const std::uint64_t most_bytes = usedAddressSpace() + memory_bytes + kLibraryBytes;
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    failData("{}: no process to read it: {}", name(), std::strerror(errno));
  }
  const pid_t parent = getpid();
  child_ = fork();
  if (child_ == 0) {
    close(ends[0]);
    serveAndExit(ends[1], *file_, parent, most_bytes);
  }
  close(ends[1]);
  socket_ = ends[0];
  if (child_ < 0) {
    close(socket_);
    failData("{}: no process to read it: {}", name(), std::strerror(errno));
  }
}

Hdf5File::~Hdf5File() {
  close(socket_);
  kill(child_, SIGKILL);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) continue;
}

void Hdf5File::failBroken() const {
  failData("{}: libhdf5 cannot cope with it: the file is broken, or takes more memory or time than it may", name());
}

std::optional<std::string> Hdf5File::ask(const nlohmann::json& question, char kind) {
  const std::string text = question.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  if (!sendHdf5Message(socket_, text)) failBroken();
  auto answer = receiveHdf5Message(socket_, kMostAnswerBytes, kTimeout_ms);
  if (!answer || answer->empty()) failBroken();
  const char found = answer->front();
  answer->erase(0, 1);
  if (found == 'n') return std::nullopt;
  if (found == 'e') failData("{}: {}", name(), *answer);
  if (found != kind) failBroken();
  return answer;
}

std::string Hdf5File::askBytes(const nlohmann::json& question) {
  auto answer = ask(question, 'b');
  if (!answer) failData("{}: there is no '{}'", name(), question.at("path").get<std::string>());
  return std::move(*answer);
}

std::optional<Hdf5Object> Hdf5File::object(const std::string& path) {
  const auto answer = ask({{"ask", "object"}, {"path", withoutSlash(path)}}, 'j');
  if (!answer) return std::nullopt;
  try {
    return hdf5ObjectFrom(nlohmann::json::parse(*answer));
  } catch (const nlohmann::json::exception&) {
    failBroken();
  }
}

std::vector<Hdf5Object> Hdf5File::datasets() {
  const auto answer = ask({{"ask", "datasets"}, {"path", ""}}, 'j');
  if (!answer) failBroken();
  try {
    std::vector<Hdf5Object> found;
    for (const nlohmann::json& said : nlohmann::json::parse(*answer)) found.push_back(hdf5ObjectFrom(said));
    return found;
  } catch (const nlohmann::json::exception&) {
    failBroken();
  }
}

std::vector<double> Hdf5File::numbers(const std::string& path) {
  const std::string bytes = askBytes({{"ask", "numbers"}, {"path", withoutSlash(path)}});
  std::vector<double> numbers(bytes.size() / sizeof(double));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(double));
  return numbers;
}

std::vector<std::byte> Hdf5File::compactBytes(const std::string& path) {
  const std::string bytes = askBytes({{"ask", "bytes"}, {"path", withoutSlash(path)}});
  const auto all = std::as_bytes(std::span(bytes));
  return {all.begin(), all.end()};
}

std::vector<Hdf5Place> Hdf5File::chunks(const std::string& path, const std::vector<std::uint64_t>& chunk,
                                        const std::vector<std::uint64_t>& first,
                                        const std::vector<std::uint64_t>& count) {
  const std::uint64_t all = std::accumulate(count.begin(), count.end(), std::uint64_t{1}, std::multiplies<>());
  std::vector<Hdf5Place> places(all);
  for (std::uint64_t begin = 0; begin < all; begin += kChunksAtATime) {
    const std::uint64_t end = std::min(begin + kChunksAtATime, all);
    const std::string bytes = askBytes({{"ask", "chunks"},
                                        {"path", withoutSlash(path)},
                                        {"chunk", chunk},
                                        {"first", first},
                                        {"count", count},
                                        {"begin", begin},
                                        {"end", end}});
    if (bytes.size() != (end - begin) * sizeof(Hdf5Place)) failBroken();
    std::memcpy(&places[begin], bytes.data(), bytes.size());
  }
  return places;
}

}  // namespace blockwalk
