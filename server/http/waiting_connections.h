// SPDX-License-Identifier: Apache-2.0
// The connections that wait for a request, or for the rest of its header: those that may be closed to make place.
#pragma once

#include <cstddef>
#include <list>

#include "server/http/wire_stream.h"

namespace blockwalk {

class WaitingConnections {
 public:
  // A connection waits as long as this lives, and from now on.
  class Place {
   public:
    Place(WaitingConnections& waiting, WireStream& stream) : waiting_(waiting) {
      place_ = waiting_.streams_.insert(waiting_.streams_.end(), &stream);
    }
    ~Place() { waiting_.streams_.erase(place_); }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    WaitingConnections& waiting_;
    std::list<WireStream*>::iterator place_;
  };

  // Closes the one that has waited longest; false when none waits.
  bool evictOne() {
    for (WireStream*& stream : streams_) {
      if (stream == nullptr) continue;
      stream->close();
      stream = nullptr;
      return true;
    }
    return false;
  }

 private:
  std::list<WireStream*> streams_;  // null: evicted, and about to go
};

}  // namespace blockwalk
