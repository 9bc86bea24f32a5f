// SPDX-License-Identifier: Apache-2.0
#include "server/render/pixel_room.h"

namespace blockwalk {

bool PixelRoom::hasRoom(Use use, std::uint64_t peer, std::int64_t pixels) const {
  const Shares& used = shares(use);
  const auto found = used.of_peers.find(peer);
  const Share own = found == used.of_peers.end() ? Share{} : found->second;
  if (use == Use::request && (used.all.leases >= max_requests_ || own.leases >= (3 * max_requests_ + 3) / 4))
    return false;
  if (used.all.leases == 0) return true;
  const std::int64_t of_use = use == Use::request ? pixels_ * 3 / 4 : pixels_;
  const std::int64_t of_peer = use == Use::request ? of_use * 3 / 4 : pixels_ * 3 / 4;
  return held() + pixels <= pixels_ && used.all.pixels + pixels <= of_use && own.pixels + pixels <= of_peer;
}

PixelRoom::Lease::Lease(PixelRoom& room, Use use, std::uint64_t peer, std::int64_t pixels)
    : room_(room), use_(use), peer_(peer), pixels_(pixels) {
  Shares& used = room_.shares(use_);
  for (Share* share : {&used.of_peers[peer_], &used.all}) {
    share->pixels += pixels_;
    ++share->leases;
  }
}

PixelRoom::Lease::~Lease() {
  Shares& used = room_.shares(use_);
  const auto own = used.of_peers.find(peer_);
  for (Share* share : {&own->second, &used.all}) {
    share->pixels -= pixels_;
    --share->leases;
  }
  if (own->second.leases == 0) used.of_peers.erase(own);
}

void PixelRoom::Lease::setBytes(std::size_t bytes) noexcept {
  const auto pixels = static_cast<std::int64_t>((bytes + 3) / 4);
  Shares& used = room_.shares(use_);
  for (Share* share : {&used.of_peers.find(peer_)->second, &used.all}) share->pixels += pixels - pixels_;
  pixels_ = pixels;
}

}  // namespace blockwalk
