// SPDX-License-Identifier: Apache-2.0
// Jobs of many clients that take turns on one device: the next turn is for who used the device least. A job stays in
// the queue until it is removed, so that it may have many turns.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <utility>

namespace blockwalk {

// Whom a turn is charged to, from the outside in. Time is shared evenly among the peers that wait, then among the
// groups of a peer, then among the clients of a group: many connections of one peer get one peer's share.
struct Account {
  std::uint64_t peer = 0;
  std::uint64_t group = 0;
  std::uint64_t client = 0;
};

// Each level has a floor, which rises by what everyone that waits would have had of each turn (the virtual time of fair
// queueing: Bennett and Zhang 1997). Who comes for the first time starts there, and no lower than the least of those
// that wait, behind them; so that however many come for one job each, who waits has its turn. Who comes back goes on
// where it was, but is owed at most kCredit_ms: silence earns no more. Not safe for several threads.
template <typename Job>
class FairQueue {
 public:
  static constexpr double kCredit_ms = 100;

  struct Entry {
    Account account;
    Job job;
    typename std::list<Entry>::iterator place = {};
  };

  // The entry stays where it is until it is removed. What throws leaves no job behind.
  Entry& add(const Account& account, Job job) {
    Node* node = &root_;
    for (std::uint64_t key : keys(account)) node = &childOf(*node, key);
    node->jobs.push_back({.account = account, .job = std::move(job)});
    Entry& entry = node->jobs.back();
    entry.place = std::prev(node->jobs.end());
    forEachLevel(account, [this](Node& parent, Node& child) {
      if (child.waiting++ == 0) beginWaiting(parent, child);
    });
    ++size_;
    return entry;
  }

  // Whose turn it is among the clients whose first entry may run; null: nobody's. Jobs of one client keep their order.
  template <typename MayRun>
  Entry* next(MayRun may_run) {
    Entry* entry = choose(root_, may_run);
    if (entry == nullptr) return nullptr;
    forEachLevel(entry->account, [](Node& parent, Node& child) {
      child.used_ms = std::max(child.used_ms, parent.floor_ms - kCredit_ms);
      parent.floor_ms = std::max(parent.floor_ms, child.used_ms);
    });
    forgetSilent(root_);
    return entry;
  }

  // Device time of a turn.
  void charge(const Entry& entry, double ms) noexcept {
    forEachLevel(entry.account, [&](Node& parent, Node& child) {
      child.used_ms += std::max(ms, 0.0);
      raiseFloor(parent, std::max(ms, 0.0));
      child.turn = ++turns_;
    });
  }

  Job remove(Entry& entry) noexcept {
    Job job = std::move(entry.job);
    Node* leaf = nullptr;
    forEachLevel(entry.account, [&](Node& parent, Node& child) {
      if (--child.waiting == 0) --parent.active;
      leaf = &child;
    });
    leaf->jobs.erase(entry.place);
    --size_;
    return job;
  }

  // Every entry, in no order; the one that is visited may be removed.
  template <typename Visit>
  void forEach(Visit visit) {
    forEachIn(root_, visit);
  }

  std::size_t size() const { return size_; }
  std::size_t peers() const { return root_.children.size(); }

 private:
  static constexpr std::size_t kMaxAccounts = 1024;  // of one level, that do not wait

  struct Node {
    double used_ms = std::numeric_limits<double>::lowest();  // until it waits for the first time
    double floor_ms = 0;                                     // of the children
    std::size_t active = 0;                                  // children that wait
    std::size_t waiting = 0;                                 // jobs in it
    std::uint64_t turn = 0;  // when it had its last one, or began to wait: of equals the first comes first
    std::map<std::uint64_t, std::unique_ptr<Node>> children;
    std::list<Entry> jobs;  // of a client
  };

  static std::array<std::uint64_t, 3> keys(const Account& account) {
    return {account.peer, account.group, account.client};
  }

  static Node& childOf(Node& node, std::uint64_t key) {
    const auto found = node.children.find(key);
    if (found != node.children.end()) return *found->second;
    return *node.children.emplace(key, std::make_unique<Node>()).first->second;
  }

  // Calls step(parent, child) from the peer to the client.
  template <typename Step>
  void forEachLevel(const Account& account, Step step) noexcept {
    Node* node = &root_;
    for (std::uint64_t key : keys(account)) {
      Node& child = *node->children.find(key)->second;
      step(*node, child);
      node = &child;
    }
  }

  void beginWaiting(Node& parent, Node& child) noexcept {
    ++parent.active;
    child.turn = ++turns_;
    if (child.used_ms != std::numeric_limits<double>::lowest()) {
      child.used_ms = std::max(child.used_ms, parent.floor_ms - kCredit_ms);
      return;
    }
    double least = std::numeric_limits<double>::max();
    for (const auto& [key, other] : parent.children) {
      if (other.get() != &child && other->waiting > 0) least = std::min(least, other->used_ms);
    }
    child.used_ms = least == std::numeric_limits<double>::max() ? parent.floor_ms : std::max(parent.floor_ms, least);
  }

  // Not beyond what one of those that wait has used: in a pause of one the others do not earn what it is owed.
  static void raiseFloor(Node& parent, double ms) noexcept {
    double most = parent.floor_ms;
    for (const auto& [key, child] : parent.children) {
      if (child->waiting > 0) most = std::max(most, child->used_ms);
    }
    parent.floor_ms = std::min(most, parent.floor_ms + ms / static_cast<double>(parent.active));
  }

  template <typename MayRun>
  static Entry* choose(Node& node, MayRun& may_run) {
    if (!node.jobs.empty()) return may_run(node.jobs.front()) ? &node.jobs.front() : nullptr;
    Entry* chosen = nullptr;
    std::pair<double, std::uint64_t> chosen_order;
    for (const auto& [key, child] : node.children) {
      if (child->waiting == 0) continue;
      const std::pair order(std::max(child->used_ms, node.floor_ms - kCredit_ms), child->turn);
      if (chosen != nullptr && order >= chosen_order) continue;
      if (Entry* entry = choose(*child, may_run)) {
        chosen = entry;
        chosen_order = order;
      }
    }
    return chosen;
  }

  // Accounts that are owed nothing more; and where many clients came for one job each, all that do not wait.
  static void forgetSilent(Node& node) noexcept {
    const bool crowded = node.children.size() > kMaxAccounts;
    std::erase_if(node.children, [&](const auto& child) {
      return child.second->waiting == 0 && (crowded || child.second->used_ms + kCredit_ms < node.floor_ms);
    });
    for (const auto& [key, child] : node.children) forgetSilent(*child);
  }

  template <typename Visit>
  static void forEachIn(Node& node, Visit& visit) {
    for (auto entry = node.jobs.begin(); entry != node.jobs.end();) visit(*entry++);
    for (const auto& [key, child] : node.children) forEachIn(*child, visit);
  }

  Node root_;
  std::uint64_t turns_ = 0;
  std::size_t size_ = 0;
};

}  // namespace blockwalk
