// SPDX-License-Identifier: Apache-2.0
// The room that pictures take from the order until they are sent, in pixels of 4 bytes: what bounds the server's
// memory, and how many requests are served at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

namespace blockwalk {

// Requests together may hold 3/4 of the room, those of one peer 3/4 of that; the rest is the streams', of which a
// peer's may hold 3/4 of the room. So neither slow readers nor one peer keep the others out. What is larger than its
// share goes alone: a request while no other holds any, a stream's frame while no other's does. So all together hold at
// most the room, one request's picture and one frame. Of the number of requests a peer may have 3/4, too. Belongs to
// the socket thread.
class PixelRoom {
 public:
  enum class Use { request, stream };

  PixelRoom(std::int64_t pixels, std::int64_t requests) : pixels_(pixels), max_requests_(requests) {}

  bool hasRoom(Use use, std::uint64_t peer, std::int64_t pixels) const;
  std::int64_t held() const { return requests_.all.pixels + streams_.all.pixels; }
  std::int64_t requests() const { return requests_.all.leases; }

  // Gives the pixels back however its owner ends.
  class Lease {
   public:
    Lease(PixelRoom& room, Use use, std::uint64_t peer, std::int64_t pixels);
    ~Lease();
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    // From now on: once encoded a frame counts as the pixels that its bytes would be.
    void setBytes(std::size_t bytes) noexcept;

   private:
    PixelRoom& room_;
    Use use_;
    std::uint64_t peer_;
    std::int64_t pixels_;
  };

 private:
  struct Share {
    std::int64_t pixels = 0;
    std::int64_t leases = 0;
  };
  struct Shares {
    Share all;
    std::map<std::uint64_t, Share> of_peers;
  };
  Shares& shares(Use use) { return use == Use::request ? requests_ : streams_; }
  const Shares& shares(Use use) const { return use == Use::request ? requests_ : streams_; }

  std::int64_t pixels_;
  std::int64_t max_requests_;
  Shares requests_;
  Shares streams_;
};

}  // namespace blockwalk
