// SPDX-License-Identifier: Apache-2.0
#include "volume/import/vdb/vdb_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <new>
#include <utility>

#include "volume/error.h"
#include "volume/import/child_bounds.h"
#include "volume/plain_text.h"

namespace blockwalk {
namespace {

constexpr std::size_t kPipeBuffer = std::size_t{1} << 16;
constexpr std::uint64_t kLibraryBytes = std::uint64_t{128} << 20;  // for the library's own tables
constexpr unsigned kMostSeconds = 600;

[[noreturn]] void workAndExit(PipeWriter writer, std::uint64_t most_bytes, pid_t parent,
                              const std::function<void(PipeWriter&)>& work) {
  boundChild(parent, most_bytes);
  alarm(kMostSeconds);
  const auto end = [&](PipeMessage message, const char* why) {
    writer.number(message);
    if (message == PipeMessage::failure) writer.text(why);
    writer.flush();
    _exit(0);
  };
  try {
    work(writer);
    end(PipeMessage::end, "");
  } catch (const std::bad_alloc&) {
    end(PipeMessage::failure, "reading it takes more memory than it may, a quarter of --memory");
  } catch (const std::exception& error) {
    end(PipeMessage::failure, error.what());
  } catch (...) {
    end(PipeMessage::failure, "what was thrown says nothing");
  }
  _exit(1);
}

}  // namespace

void PipeWriter::bytes(std::span<const std::byte> bytes) {
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  if (buffer_.size() >= kPipeBuffer) flush();
}

void PipeWriter::text(const std::string& text) {
  const auto count = static_cast<std::uint32_t>(std::min(text.size(), kMostText));
  number(count);
  bytes(std::as_bytes(std::span(text)).first(count));
}

void PipeWriter::flush() {
  std::span<const std::byte> left = buffer_;
  while (!left.empty()) {
    const ssize_t wrote = write(descriptor_, left.data(), left.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) _exit(1);
    left = left.subspan(static_cast<std::size_t>(wrote));
  }
  buffer_.clear();
}

PipedProcess::PipedProcess(std::string name, std::uint64_t memory_bytes, const std::function<void(PipeWriter&)>& work)
    : name_(std::move(name)), memory_bytes_(memory_bytes), buffer_(kPipeBuffer) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) failData("{}: no pipe to read it through: {}", name_, std::strerror(errno));
  const std::uint64_t most_bytes = usedAddressSpace() + memory_bytes + kLibraryBytes;
  const pid_t parent = getpid();
  child_ = fork();
  if (child_ == 0) {
    close(ends[0]);
    workAndExit(PipeWriter(ends[1]), most_bytes, parent, work);
  }
  const int error = errno;
  close(ends[1]);
  descriptor_ = ends[0];
  if (child_ > 0) return;
  close(descriptor_);
  failData("{}: no process to read it: {}", name_, std::strerror(error));
}

PipedProcess::~PipedProcess() {
  close(descriptor_);
  if (child_ < 0) return;
  kill(child_, SIGKILL);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) continue;
}

std::size_t PipedProcess::some(std::span<std::byte> out) {
  if (at_ == filled_) {
    ssize_t got = 0;
    do got = ::read(descriptor_, buffer_.data(), buffer_.size());
    while (got < 0 && errno == EINTR);
    at_ = 0;
    filled_ = got < 0 ? 0 : static_cast<std::size_t>(got);
  }
  const std::size_t count = std::min(out.size(), filled_ - at_);
  std::memcpy(out.data(), buffer_.data() + at_, count);
  at_ += count;
  return count;
}

void PipedProcess::bytes(std::span<std::byte> out) {
  while (!out.empty()) {
    const std::size_t got = some(out);
    if (got == 0) failEnded();
    out = out.subspan(got);
  }
}

std::string PipedProcess::text() {
  const auto count = number<std::uint32_t>();
  if (count > kMostText) failData("{}: OpenVDB: what it read of the file makes no sense", name_);
  std::string text(count, '\0');
  bytes(std::as_writable_bytes(std::span(text)));
  return plainText(text);
}

bool PipedProcess::next() {
  switch (number<PipeMessage>()) {
    case PipeMessage::item:
      return true;
    case PipeMessage::end:
      return false;
    case PipeMessage::failure:
      failData("{}: OpenVDB: {}", name_, text());
  }
  failData("{}: OpenVDB: what it read of the file makes no sense", name_);
}

void PipedProcess::failEnded() {
  int status = 0;
  while (waitpid(child_, &status, 0) < 0 && errno == EINTR) continue;
  child_ = -1;
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
    failData("{}: OpenVDB did not come to an end in {} seconds", name_, kMostSeconds);
  }
  failData("{}: OpenVDB cannot read it: it is broken, or takes more memory than the {} bytes that it may", name_,
           memory_bytes_);
}

}  // namespace blockwalk
