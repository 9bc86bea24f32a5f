// SPDX-License-Identifier: Apache-2.0
// So many of something at a time, and so many of one peer.
#pragma once

#include <cstdint>
#include <map>
#include <memory>

namespace blockwalk {

// Belongs to the socket thread. Leases have the counts in common, as coroutines may be destroyed after all else.
class PeerPlaces {
 public:
  PeerPlaces(int most, int most_of_peer) : most_(most), most_of_peer_(most_of_peer) {}

  // As long as it lives a place is taken; null when there are as many as may be.
  std::shared_ptr<void> lease(std::uint64_t peer) {
    int all = 0;
    for (const auto& [other, count] : *taken_) all += count;
    const auto own = taken_->find(peer);
    if (all >= most_ || (own != taken_->end() && own->second >= most_of_peer_)) return nullptr;
    return std::make_shared<Lease>(taken_, peer);
  }

 private:
  using Counts = std::map<std::uint64_t, int>;
  class Lease {
   public:
    Lease(std::shared_ptr<Counts> taken, std::uint64_t peer) : taken_(std::move(taken)), peer_(peer) {
      ++(*taken_)[peer_];
    }
    ~Lease() {
      const auto entry = taken_->find(peer_);
      if (--entry->second == 0) taken_->erase(entry);
    }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;

   private:
    std::shared_ptr<Counts> taken_;
    std::uint64_t peer_;
  };

  int most_;
  int most_of_peer_;
  std::shared_ptr<Counts> taken_ = std::make_shared<Counts>();
};

}  // namespace blockwalk
