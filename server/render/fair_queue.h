// SPDX-License-Identifier: Apache-2.0
// Jobs of many clients in the order that shares a device fairly: next comes a job of the client that used it least.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>

namespace blockwalk {

// A client that comes, or comes back, starts at the least time of those that wait, so that silence earns no credit.
// Not safe for several threads.
template <typename Job>
class FairQueue {
 public:
  void add(std::uint64_t client, Job job) {
    Account& account = accounts_[client];
    if (account.jobs.empty()) account.used_ms = std::max(account.used_ms, floor_ms_);
    account.jobs.push_back(std::move(job));
    ++size_;
  }

  // The next job and its client; jobs of one client keep their order.
  std::optional<std::pair<std::uint64_t, Job>> take() {
    auto next = accounts_.end();
    for (auto account = accounts_.begin(); account != accounts_.end(); ++account) {
      if (account->second.jobs.empty()) continue;
      if (next == accounts_.end() || account->second.used_ms < next->second.used_ms) next = account;
    }
    if (next == accounts_.end()) return {};
    floor_ms_ = next->second.used_ms;
    std::pair<std::uint64_t, Job> taken{next->first, std::move(next->second.jobs.front())};
    next->second.jobs.pop_front();
    --size_;
    // Accounts that say no more than the floor does are forgotten, and where many clients came for one job each, all
    // that do not wait.
    const bool crowded = accounts_.size() > kMaxAccounts;
    std::erase_if(accounts_, [&](const auto& account) {
      return account.second.jobs.empty() && (crowded || account.second.used_ms < floor_ms_);
    });
    return taken;
  }

  // Device time that the client's last job took.
  void charge(std::uint64_t client, double ms) { accounts_[client].used_ms += std::max(ms, 0.0); }

  std::size_t size() const { return size_; }

  std::size_t accounts() const { return accounts_.size(); }

 private:
  static constexpr std::size_t kMaxAccounts = 1024;

  struct Account {
    double used_ms = 0;
    std::deque<Job> jobs;
  };
  std::map<std::uint64_t, Account> accounts_;
  double floor_ms_ = 0;
  std::size_t size_ = 0;
};

}  // namespace blockwalk
