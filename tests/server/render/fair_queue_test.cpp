// SPDX-License-Identifier: Apache-2.0
// The order of turns, as a model: jobs that take a number of turns, and a device that takes a time for each.
#include "server/render/fair_queue.h"

#include <gtest/gtest.h>

#include <functional>

namespace blockwalk {
namespace {

using Queue = FairQueue<int>;
constexpr auto kAnyJob = [](const Queue::Entry&) { return true; };

Account peer(std::uint64_t number) { return {.peer = number, .group = number, .client = number}; }

// A device that draws: each job is a number of pieces.
class Device {
 public:
  explicit Device(double piece_ms) : piece_ms_(piece_ms) {}

  void add(const Account& account, int pieces) { queue_.add(account, pieces); }
  // One turn. Returns whose it was; `done` is called when it was the job's last.
  std::uint64_t turn(const std::function<void(const Account&)>& done) {
    Queue::Entry* entry = queue_.next(kAnyJob);
    if (entry == nullptr) {
      now_ms_ += 1;
      return 0;
    }
    const Account account = entry->account;
    queue_.charge(*entry, piece_ms_);
    now_ms_ += piece_ms_;
    used_ms_[account.peer] += piece_ms_;
    if (--entry->job == 0) {
      queue_.remove(*entry);
      done(account);
    }
    return account.peer;
  }
  double now() const { return now_ms_; }
  double used(std::uint64_t number) { return used_ms_[number]; }
  Queue& queue() { return queue_; }

 private:
  Queue queue_;
  double piece_ms_;
  double now_ms_ = 0;
  std::map<std::uint64_t, double> used_ms_;
};

// A stream with frames of `pieces`, the next of which is ordered `gap_ms` after the last was drawn.
struct Stream {
  Account account;
  int pieces;
  double gap_ms;
  double next_ms = 0;
  bool is_drawing = false;
  int frames = 0;
  double last_ms = 0;
  double longest_gap_ms = 0;

  void order(Device& device) {
    if (is_drawing || device.now() < next_ms) return;
    device.add(account, pieces);
    is_drawing = true;
  }
  void drawn(const Device& device) {
    ++frames;
    longest_gap_ms = std::max(longest_gap_ms, device.now() - last_ms);
    last_ms = device.now();
    next_ms = device.now() + gap_ms;
    is_drawing = false;
  }
};

TEST(FairQueue, KeepsTheOrderOfOneClient) {
  Queue queue;
  for (int i = 0; i < 5; ++i) queue.add(peer(1), i);
  for (int i = 0; i < 5; ++i) {
    Queue::Entry* entry = queue.next(kAnyJob);
    ASSERT_NE(entry, nullptr);
    EXPECT_EQ(queue.remove(*entry), i);
  }
  EXPECT_EQ(queue.next(kAnyJob), nullptr);
  EXPECT_EQ(queue.size(), 0u);
}

TEST(FairQueue, SharesByDeviceTimeAndNotByCount) {
  Queue queue;
  std::map<std::uint64_t, double> used;
  const std::map<std::uint64_t, double> cost{{1, 1}, {2, 10}, {3, 40}};
  for (const auto& [number, ms] : cost) queue.add(peer(number), 0);
  for (int i = 0; i < 2000; ++i) {
    Queue::Entry* entry = queue.next(kAnyJob);
    const std::uint64_t number = entry->account.peer;
    used[number] += cost.at(number);
    queue.charge(*entry, cost.at(number));
  }
  EXPECT_NEAR(used[1], used[3], 80);
  EXPECT_NEAR(used[2], used[3], 80);
}

// Turns of 10 ms in a row that peer 1 has when it comes back after `away` turns of peer 2.
int turnsAfterSilence(int away) {
  Device device(10);
  device.add(peer(1), 1);
  device.turn([](const Account&) {});
  for (int i = 0; i < away; ++i) {
    device.add(peer(2), 1);
    device.turn([](const Account&) {});
  }
  device.add(peer(1), 1000);
  device.add(peer(2), 1000);
  int in_a_row = 0;
  while (device.turn([](const Account&) {}) == 1) ++in_a_row;
  return in_a_row;
}

TEST(FairQueue, SilenceEarnsNoMoreThanTheCredit) {
  EXPECT_LE(turnsAfterSilence(1000), 12);
  EXPECT_NEAR(turnsAfterSilence(5), 5, 1) << "what it is owed for a short pause is its own";
}

// Each of the newcomers is another peer, as connections were once.
TEST(FairQueue, NewcomersForOneJobEachDoNotPassWhoWaits) {
  Device device(10);
  device.add(peer(1), 1);
  device.turn([](const Account&) {});  // it has used the device
  device.add(peer(1), 1000);
  std::uint64_t newest = 1;
  for (int i = 0; i < 2; ++i) device.add(peer(++newest), 1);
  int turns = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t whose = device.turn([&](const Account&) { device.add(peer(++newest), 1); });
    if (whose == 1) ++turns;
  }
  EXPECT_GE(turns, 0.9 * 1000 / 3) << "a third: two others wait at any time";
}

TEST(FairQueue, AStreamBesideEndlessRequestsOfAnotherPeerGetsHalf) {
  for (const bool is_same_peer : {false, true}) {
    Device device(25);
    Stream stream{.account = {.peer = 1, .group = 7, .client = 7}, .pieces = 4, .gap_ms = 10};
    const std::uint64_t other = is_same_peer ? 1 : 2;
    std::uint64_t newest = 100;
    const auto request = [&] { device.add({.peer = other, .group = 0, .client = ++newest}, 4); };
    for (int i = 0; i < 2; ++i) request();
    double stream_ms = 0;
    while (device.now() < 60000) {
      stream.order(device);
      const double before = device.now();
      bool was_stream = false;
      device.turn([&](const Account& account) {
        was_stream = account.group == 7;
        was_stream ? stream.drawn(device) : request();
      });
      if (was_stream) stream_ms += 4 * (device.now() - before);
    }
    EXPECT_GE(stream_ms, 0.9 * device.now() / 2) << is_same_peer;
    EXPECT_LE(stream.longest_gap_ms, 500);
  }
}

// One asks for pictures of 13 s each, on one connection, without end.
TEST(FairQueue, AStreamBesideOneHogHasHalfItsFrames) {
  Device device(25);
  Stream stream{.account = peer(1), .pieces = 3, .gap_ms = 25};  // 10 frames a second alone
  device.add({.peer = 2, .group = 0, .client = 5}, 13000 / 25);
  while (device.now() < 60000) {
    stream.order(device);
    device.turn([&](const Account& account) {
      account.peer == 1 ? stream.drawn(device) : device.add({.peer = 2, .group = 0, .client = 5}, 13000 / 25);
    });
  }
  EXPECT_GE(stream.frames / 60.0, 4.5);
  EXPECT_LE(stream.longest_gap_ms, 500);
}

// All of one peer, or each of a peer of its own: a stream of that peer, and one of another.
TEST(FairQueue, SixtyFourAtOnceAreOnePeer) {
  Device device(25);
  Stream neighbour{.account = {.peer = 1, .group = 9, .client = 9}, .pieces = 3, .gap_ms = 25};
  Stream other{.account = peer(2), .pieces = 3, .gap_ms = 25};
  for (std::uint64_t client = 100; client < 164; ++client) {
    device.add({.peer = 1, .group = 0, .client = client}, 13000 / 25);
  }
  while (device.now() < 60000) {
    neighbour.order(device);
    other.order(device);
    device.turn([&](const Account& account) {
      if (account.peer == 2) other.drawn(device);
      if (account.group == 9) neighbour.drawn(device);
    });
  }
  EXPECT_GE(75 * other.frames, 0.9 * device.now() / 2) << "half: there are two peers";
  EXPECT_GE(75 * neighbour.frames, 0.9 * device.now() / 4) << "half of its peer's half";
  EXPECT_LE(other.longest_gap_ms, 500);
  EXPECT_LE(neighbour.longest_gap_ms, 500);
}

TEST(FairQueue, AShortRequestPassesTheLongOnesOfItsPeer) {
  Device device(25);
  for (std::uint64_t client = 1; client <= 8; ++client) device.add({.peer = 1, .group = 0, .client = client}, 500);
  for (int i = 0; i < 100; ++i) device.turn([](const Account&) {});
  device.add({.peer = 1, .group = 0, .client = 9}, 2);
  bool is_done = false;
  int turns = 0;
  while (!is_done) {
    device.turn([&](const Account& account) { is_done = account.client == 9; });
    ++turns;
  }
  EXPECT_LE(turns, 2 * 9 + 1);
}

TEST(FairQueue, WhoMayNotRunIsPassedAndOwedNoMoreThanTheCredit) {
  Queue queue;
  queue.add(peer(1), 1);
  queue.add(peer(2), 2);
  const auto second_only = [](const Queue::Entry& entry) { return entry.job == 2; };
  for (int i = 0; i < 1000; ++i) queue.charge(*queue.next(second_only), 10);
  int in_a_row = 0;
  for (Queue::Entry* entry = queue.next(kAnyJob); entry->job == 1; entry = queue.next(kAnyJob)) {
    queue.charge(*entry, 10);
    ++in_a_row;
  }
  EXPECT_LE(in_a_row, 12);
}

TEST(FairQueue, ManyClientsOfOneJobEachAreForgotten) {
  Device device(2);
  for (std::uint64_t client = 1; client <= 5000; ++client) {
    device.add(peer(client), 1);
    device.turn([](const Account&) {});
  }
  EXPECT_LE(device.queue().peers(), 1100u);
  EXPECT_EQ(device.queue().size(), 0u);
}

}  // namespace
}  // namespace blockwalk
