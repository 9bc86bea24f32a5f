// SPDX-License-Identifier: Apache-2.0
// Progress of long work on stderr: a bar on a terminal, one line a step otherwise.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace blockwalk {

class Progress {
 public:
  Progress();
  ~Progress();  // closes the step that is shown
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // May be called often: a terminal is written to ten times a second at most.
  void show(std::string_view step, std::uint64_t done, std::uint64_t total);

 private:
  using Clock = std::chrono::steady_clock;
  void close();
  void draw(std::uint64_t done, std::uint64_t total) const;

  bool terminal_;
  std::string step_;
  Clock::time_point begun_;
  Clock::time_point drawn_;
};

}  // namespace blockwalk
