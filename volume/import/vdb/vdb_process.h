// SPDX-License-Identifier: Apache-2.0
// OpenVDB's reader on files that nobody vouches for: it throws, ends the program by an assertion or takes what memory
// it is told to. So it works in a process of its own, and what it reads comes back through a pipe as plain bytes.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace blockwalk {

// The end of the pipe that the other process writes to.
class PipeWriter {
 public:
  explicit PipeWriter(int descriptor) : descriptor_(descriptor) {}

  void bytes(std::span<const std::byte> bytes);
  template <typename T>
  void number(T value) {
    bytes(std::as_bytes(std::span(&value, 1)));
  }
  void text(const std::string& text);  // of more than kMostText bytes the first
  // Ends the process where nobody reads.
  void flush();

 private:
  int descriptor_;
  std::vector<std::byte> buffer_;
};

// A process that runs one function and goes away with its owner. The bytes that it writes are as little to be trusted
// as the file that they come from.
class PipedProcess {
 public:
  // `name` is the file's, for messages. The process may take `memory_bytes` more than this one has. What `work` throws
  // becomes a DataError of whoever reads on.
  PipedProcess(std::string name, std::uint64_t memory_bytes, const std::function<void(PipeWriter&)>& work);
  ~PipedProcess();
  PipedProcess(const PipedProcess&) = delete;
  PipedProcess& operator=(const PipedProcess&) = delete;

  // The next message; false at the end of all. Throws DataError where the process failed or came to a bad end.
  bool next();
  // Of the message: fill, or throw DataError.
  void bytes(std::span<std::byte> out);
  template <typename T>
  T number() {
    T value{};
    bytes(std::as_writable_bytes(std::span(&value, 1)));
    return value;
  }
  std::string text();  // plain, whatever the file has

 private:
  std::size_t some(std::span<std::byte> out);
  [[noreturn]] void failEnded();

  std::string name_;
  std::uint64_t memory_bytes_;
  pid_t child_ = -1;
  int descriptor_ = -1;
  std::vector<std::byte> buffer_;
  std::size_t at_ = 0;
  std::size_t filled_ = 0;
};

// What the messages of a process begin with.
enum class PipeMessage : std::uint8_t { failure = 1, item = 2, end = 3 };

constexpr std::size_t kMostText = 1024;

}  // namespace blockwalk
