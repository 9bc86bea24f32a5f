// SPDX-License-Identifier: Apache-2.0
#include "clients/cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace blockwalk {
namespace {

// The work goes on when nobody listens.
void say(const std::string& text) { std::fputs(text.c_str(), stderr); }

}  // namespace

Progress::Progress() : terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() { close(); }

void Progress::show(std::string_view step, std::uint64_t done, std::uint64_t total) {
  const auto now = Clock::now();
  if (step != step_) {
    close();
    step_ = step;
    begun_ = now;
    drawn_ = {};
  }
  if (!terminal_ || now - drawn_ < std::chrono::milliseconds(100)) return;
  drawn_ = now;
  draw(done, total);
}

void Progress::draw(std::uint64_t done, std::uint64_t total) const {
  constexpr std::uint64_t kWidth = 32;
  const double share = total == 0 ? 1.0 : static_cast<double>(std::min(done, total)) / static_cast<double>(total);
  const auto filled = static_cast<std::size_t>(share * kWidth);
  say(fmt::format("\r{:<12} [{:<32}] {:3.0f} %", step_, std::string(filled, '#'), 100 * share));
  std::fflush(stderr);
}

void Progress::close() {
  if (step_.empty()) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - begun_).count();
  // Erases the bar: what stays on a terminal is what a log gets.
  say(fmt::format("{}{}: {:.2f} s\n", terminal_ ? "\r\x1b[K" : "", step_, seconds));
  step_.clear();
}

}  // namespace blockwalk
